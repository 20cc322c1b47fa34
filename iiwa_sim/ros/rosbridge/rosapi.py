"""The introspection services for clients of rosbridge, in the words of ROS 1: those of the package rosapi."""

from collections.abc import Callable, Iterable
from typing import Any

import msgspec

from iiwa_sim.ros.rmi.definitions import PRIMITIVES, Definition, full_text, parts, service
from iiwa_sim.ros.rmi.node import PUBLISHED, SUBSCRIBED, Node

Values = dict[str, Any]
Call = Callable[[Values], Values]

NODE = "/iiwa_sim"
_LIST, _SINGLE = 0, -1  # of fieldarraylen


class RosApi:
    """Answers about one node. A call takes arguments as they come; KeyError names what does not exist."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._topics = {name: kind for name, (kind, _) in PUBLISHED.items()} | dict(SUBSCRIBED)
        topic, service_name, kind = ("topic",), ("service",), ("type",)
        calls: dict[str, tuple[str, tuple[str, ...], Call]] = {
            "topics": ("Topics", (), lambda _: self._topics_and_types()),
            "topics_and_raw_types": ("TopicsAndRawTypes", (), lambda _: self._topics_and_raw_types()),
            "topic_type": ("TopicType", topic, lambda v: {"type": self._topics.get(named(v, "topic"), "")}),
            "topics_for_type": ("TopicsForType", kind, lambda v: {"topics": of_type(self._topics, v)}),
            "services": ("Services", (), lambda _: {"services": list(self._services)}),
            "service_type": (
                "ServiceType",
                service_name,
                lambda v: {"type": self._services.get(named(v, "service"), "")},
            ),
            "services_for_type": (
                "ServicesForType",
                kind,
                lambda v: {"services": of_type(self._services, v)},
            ),
            "nodes": ("Nodes", (), lambda _: {"nodes": [NODE]}),
            "node_details": ("NodeDetails", ("node",), self._node_details),
            "publishers": (
                "Publishers",
                topic,
                lambda v: {"publishers": _if(named(v, "topic") in PUBLISHED)},
            ),
            "subscribers": (
                "Subscribers",
                topic,
                lambda v: {"subscribers": _if(named(v, "topic") in SUBSCRIBED)},
            ),
            "action_servers": ("GetActionServers", (), lambda _: {"action_servers": []}),
            "message_details": ("MessageDetails", kind, lambda v: _details(node.definition(_kind(v)))),
            "service_request_details": (
                "ServiceRequestDetails",
                kind,
                lambda v: _details(service(_kind(v)).request),
            ),
            "service_response_details": (
                "ServiceResponseDetails",
                kind,
                lambda v: _details(service(_kind(v)).response),
            ),
            "get_time": ("GetTime", (), lambda _: {"time": node.time()}),
            "get_param_names": ("GetParamNames", (), lambda _: {"names": []}),
            "has_param": ("HasParam", ("name",), lambda _: {"exists": False}),
            "get_param": ("GetParam", ("name", "default"), _param),
        }
        self.calls = {f"/rosapi/{name}": (names, call) for name, (_, names, call) in calls.items()}
        """Argument names and handler of each service."""
        self._services = {
            **node.services,
            **{f"/rosapi/{name}": f"rosapi/{kind}" for name, (kind, _, _) in calls.items()},
        }

    def _topics_and_types(self) -> Values:
        return {"topics": list(self._topics), "types": list(self._topics.values())}

    def _topics_and_raw_types(self) -> Values:
        texts = [full_text(self._node.definition(kind)) for kind in self._topics.values()]
        return {**self._topics_and_types(), "typedefs_full_text": texts}

    def _node_details(self, values: Values) -> Values:
        here = named(values, "node") == NODE
        return {
            "publishing": list(PUBLISHED) if here else [],
            "subscribing": list(SUBSCRIBED) if here else [],
            "services": list(self._services) if here else [],
        }


def rooted(name: str) -> str:
    """A name with its leading slash, which many clients leave out."""
    return name if name.startswith("/") else f"/{name}"


def named(values: Values, field: str) -> str:
    """The name that an argument is, with its slash."""
    return rooted(str(values.get(field, "")))


def _kind(values: Values) -> str:
    return str(values.get("type", ""))


def _if(there: bool) -> list[str]:
    return [NODE] if there else []


def _param(values: Values) -> Values:
    """There are no parameters: returns the default, which is JSON as the answer is, or null."""
    default = str(values.get("default", ""))
    try:
        msgspec.json.decode(default)
    except (msgspec.DecodeError, RecursionError):
        default = "null" if default == "" else msgspec.json.encode(default).decode()
    return {"value": default}


def of_type(all_of_them: dict[str, str], values: Values) -> list[str]:
    """The names of what is of the type that the arguments name."""
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
