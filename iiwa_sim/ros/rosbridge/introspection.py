"""The introspection services for clients of rosbridge that the packages rosapi of ROS 1 and ROS 2 share."""

from collections.abc import Callable, Mapping
from typing import Any

Values = dict[str, Any]
Call = Callable[[Values], Values]
Row = tuple[str, tuple[str, ...], Call]
"""Type of a service, the names of its arguments, and what answers it."""

NODE = "/iiwa_sim"
TOPIC, SERVICE, KIND = ("topic",), ("service",), ("type",)
"""Arguments."""


class Introspection:
    """Answers about one node. A call takes arguments as they come; KeyError names what does not exist."""

    def __init__(
        self,
        published: Mapping[str, str],
        subscribed: Mapping[str, str],
        served: Mapping[str, str],
        full_text: Callable[[str], str],
        package: str,
        own: Mapping[str, Row],
    ) -> None:
        """`published`, `subscribed` and `served` are the types of topics and services by name, `full_text`
        gives the definition of a type of message; `own` are services besides those here, all with types of
        `package`."""
        self.topics = {**published, **subscribed}
        """Type of each topic by name."""
        rows: dict[str, Row] = {
            "topics": ("Topics", (), lambda _: self._topics_and_types()),
            "topics_and_raw_types": (
                "TopicsAndRawTypes",
                (),
                lambda _: {
                    **self._topics_and_types(),
                    "typedefs_full_text": list(map(full_text, self.topics.values())),
                },
            ),
            "topic_type": ("TopicType", TOPIC, lambda v: {"type": self.topics.get(named(v, "topic"), "")}),
            "topics_for_type": ("TopicsForType", KIND, lambda v: {"topics": _of_type(self.topics, v)}),
            "services": ("Services", (), lambda _: {"services": list(self.services)}),
            "service_type": (
                "ServiceType",
                SERVICE,
                lambda v: {"type": self.services.get(named(v, "service"), "")},
            ),
            "services_for_type": (
                "ServicesForType",
                KIND,
                lambda v: {"services": _of_type(self.services, v)},
            ),
            "nodes": ("Nodes", (), lambda _: {"nodes": [NODE]}),
            "node_details": (
                "NodeDetails",
                ("node",),
                lambda v: {
                    name: list(each) if named(v, "node") == NODE else []
                    for name, each in (
                        ("publishing", published),
                        ("subscribing", subscribed),
                        ("services", self.services),
                    )
                },
            ),
            "publishers": ("Publishers", TOPIC, lambda v: {"publishers": _if_in(published, v)}),
            "subscribers": ("Subscribers", TOPIC, lambda v: {"subscribers": _if_in(subscribed, v)}),
            "get_param_names": ("GetParamNames", (), lambda _: {"names": []}),
            "has_param": ("HasParam", ("name",), lambda _: {"exists": False}),
            **own,
        }
        self.calls = {f"/rosapi/{name}": (names, call) for name, (_, names, call) in rows.items()}
        """Argument names and handler of each service."""
        here = {f"/rosapi/{name}": f"{package}/{kind}" for name, (kind, _, _) in rows.items()}
        self.services = {**served, **here}
        """Type of each service by name."""

    def _topics_and_types(self) -> Values:
        return {"topics": list(self.topics), "types": list(self.topics.values())}


def rooted(name: str) -> str:
    """A name with its leading slash, which many clients leave out."""
    return name if name.startswith("/") else f"/{name}"


def named(values: Values, field: str) -> str:
    """The name that an argument is, with its slash."""
    return rooted(str(values.get(field, "")))


def _of_type(all_of_them: Mapping[str, str], values: Values) -> list[str]:
    """The names of what is of the type that the arguments name."""
    return [name for name, kind in all_of_them.items() if kind == values.get("type")]


def _if_in(topics: Mapping[str, str], values: Values) -> list[str]:
    """The node, where the topic that the arguments name is one of these."""
    return [NODE] if named(values, "topic") in topics else []
