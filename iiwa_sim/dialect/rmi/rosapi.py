"""The services with which clients of rosbridge ask what there is: those of the package rosapi."""

from collections.abc import Callable, Iterable
from typing import Any

from iiwa_sim.dialect.rmi.definitions import PRIMITIVES, Definition, message, parts, service
from iiwa_sim.dialect.rmi.node import PUBLISHED, SUBSCRIBED, Node

Values = dict[str, Any]

NODE = "/iiwa_sim"
_LIST, _SINGLE = 0, -1  # of fieldarraylen


class RosApi:
    """What is asked of one node. A call takes arguments as they come; KeyError names what there is not."""

    def __init__(self, node: Node, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._topics = {name: kind for name, (kind, _) in PUBLISHED.items()} | dict(SUBSCRIBED)
        calls: dict[str, tuple[str, Callable[[Values], Values]]] = {
            "topics": ("Topics", lambda _: _names_and_types("topics", self._topics)),
            "topic_type": ("TopicType", lambda v: {"type": self._topics.get(_named(v, "topic"), "")}),
            "topics_for_type": ("TopicsForType", lambda v: {"topics": _of_type(self._topics, v)}),
            "services": ("Services", lambda _: {"services": list(self._services)}),
            "service_type": ("ServiceType", lambda v: {"type": self._services.get(_named(v, "service"), "")}),
            "services_for_type": ("ServicesForType", lambda v: {"services": _of_type(self._services, v)}),
            "nodes": ("Nodes", lambda _: {"nodes": [NODE]}),
            "node_details": ("NodeDetails", self._node_details),
            "publishers": ("Publishers", lambda v: {"publishers": _if(_named(v, "topic") in PUBLISHED)}),
            "subscribers": ("Subscribers", lambda v: {"subscribers": _if(_named(v, "topic") in SUBSCRIBED)}),
            "message_details": ("MessageDetails", lambda v: _details(message(_kind(v)))),
            "service_request_details": (
                "ServiceRequestDetails",
                lambda v: _details(service(_kind(v)).request),
            ),
            "service_response_details": (
                "ServiceResponseDetails",
                lambda v: _details(service(_kind(v)).response),
            ),
            "get_time": ("GetTime", self._time),
            "get_param_names": ("GetParamNames", lambda _: {"names": []}),
        }
        self.calls = {f"/rosapi/{name}": call for name, (_, call) in calls.items()}
        """By name of the service."""
        self._services = {
            **node.services,
            **{f"/rosapi/{name}": f"rosapi/{kind}" for name, (kind, _) in calls.items()},
        }

    def _node_details(self, values: Values) -> Values:
        here = _named(values, "node") == NODE
        return {
            "publishing": list(PUBLISHED) if here else [],
            "subscribing": list(SUBSCRIBED) if here else [],
            "services": list(self._services) if here else [],
        }

    def _time(self, _: Values) -> Values:
        secs, nsecs = divmod(self._now_ns(), 1_000_000_000)
        return {"time": {"secs": secs, "nsecs": nsecs}}


def rooted(name: str) -> str:
    """A name with its slash, which many clients leave out."""
    return name if name.startswith("/") else f"/{name}"


def _named(values: Values, field: str) -> str:
    return rooted(str(values.get(field, "")))


def _kind(values: Values) -> str:
    return str(values.get("type", ""))


def _if(there: bool) -> list[str]:
    return [NODE] if there else []


def _names_and_types(names: str, all_of_them: dict[str, str]) -> Values:
    return {names: list(all_of_them), "types": list(all_of_them.values())}


def _of_type(all_of_them: dict[str, str], values: Values) -> list[str]:
    return [name for name, kind in all_of_them.items() if kind == values.get("type")]


def _details(definition: Definition) -> Values:
    return {"typedefs": [_typedef(part) for part in parts(definition)]}


def _typedef(definition: Definition) -> Values:
    def each(make: Callable[[Any], Any], rows: Iterable[Any]) -> list[Any]:
        return [make(row) for row in rows]

    return {
        "type": definition.name,
        "fieldnames": each(lambda field: field.name, definition.fields),
        "fieldtypes": each(lambda field: field.type, definition.fields),
        "fieldarraylen": each(lambda field: _LIST if field.is_list else _SINGLE, definition.fields),
        "examples": each(_example, definition.fields),
        "constnames": each(lambda constant: constant[1], definition.constants),
        "constvalues": each(lambda constant: constant[2], definition.constants),
    }


def _example(field: Any) -> str:
    if field.is_list:
        return "[]"
    default = PRIMITIVES.get(field.type, (None, None))[1]
    return "{}" if default is None else str(default)
