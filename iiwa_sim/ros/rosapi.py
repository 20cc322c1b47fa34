"""The introspection services for clients of rosbridge: those of the package rosapi, of ROS 1 and of ROS 2.

https://github.com/RobotWebTools/rosbridge_suite/tree/ros2/rosapi
"""

from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from iiwa_sim.ros.graph import Graph, Served, Topic
from iiwa_sim.ros.joint_interface import ACTION
from iiwa_sim.ros.messages import Message, interface, short_name, to_ros1

NODE = "/iiwa_sim"
PREFIX = "/rosapi/"
ACTION_SERVERS, ROS_VERSION = f"{PREFIX}action_servers", f"{PREFIX}get_ros_version"

Api = tuple[str, tuple[str, ...], Callable[[Message, bool], Message]]
"""Type without the package, names of the arguments, and a handler of these and of whether the client speaks
ROS 2. KeyError names what does not exist."""


def rooted(name: str) -> str:
    """Return a name with its leading slash, which many clients leave out."""
    return name if name.startswith("/") else f"/{name}"


class RosApi:
    """Answers questions about one node and its graph."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        kind = ("type",)
        apis: dict[str, Api] = {
            "topics": ("Topics", (), lambda _, ros2: _listed(self._topics(ros2))),
            "topics_and_raw_types": ("TopicsAndRawTypes", (), self._raw_types),
            "topic_type": ("TopicType", ("topic",), lambda v, ros2: _type_in(self._topics(ros2), v, "topic")),
            "topics_for_type": ("TopicsForType", kind, lambda v, r: {"topics": _of(self._topics(r), v)}),
            "services": ("Services", (), lambda _, ros2: {"services": list(self._services(ros2))}),
            "service_type": (
                *("ServiceType", ("service",)),
                lambda v, ros2: _type_in(self._services(ros2), v, "service"),
            ),
            "services_for_type": (
                *("ServicesForType", kind),
                lambda v, ros2: {"services": _of(self._services(ros2), v)},
            ),
            "nodes": ("Nodes", (), lambda _, __: {"nodes": [NODE]}),
            "message_details": ("MessageDetails", kind, _details("msg", 0)),
            "service_request_details": ("ServiceRequestDetails", kind, _details("srv", 0)),
            "service_response_details": ("ServiceResponseDetails", kind, _details("srv", 1)),
            "action_servers": ("GetActionServers", (), lambda _, __: {"action_servers": [ACTION]}),
            "get_time": ("GetTime", (), lambda _, r: {"time": graph.stamp if r else to_ros1(graph.stamp)}),
            "get_ros_version": ("GetROSVersion", (), lambda _, __: {"version": 2, "distro": ""}),
            "get_param_names": ("GetParamNames", (), lambda _, __: {"names": []}),
            "has_param": ("HasParam", ("name",), lambda _, __: {"exists": False}),
            "get_param": ("GetParam", ("name", "default"), _param),
        }
        self.services = {f"{PREFIX}{name}": api for name, api in apis.items()}

    def _topics(self, ros2: bool) -> dict[str, str]:
        return {**_told(self._graph.published, ros2), **_told(self._graph.subscribed, ros2)}

    def _services(self, ros2: bool) -> dict[str, str]:
        package = "rosapi_msgs/srv" if ros2 else "rosapi"
        here = {name: f"{package}/{kind}" for name, (kind, _, _) in self.services.items()}
        return {**_told(self._graph.services, ros2), **here}

    def _raw_types(self, _: Message, ros2: bool) -> Message:
        topics = self._topics(ros2)
        texts = [interface(kind, "msg", ros2=ros2)[0].full_text for kind in topics.values()]
        return {**_listed(topics), "typedefs_full_text": texts}


def _told(named: Mapping[str, Topic] | Mapping[str, Served], ros2: bool) -> dict[str, str]:
    """The types by name, as a client of that ROS knows them."""
    shown = {name: each for name, each in named.items() if ros2 or each.in_ros1}
    return {name: each.kind if ros2 else short_name(each.kind) for name, each in shown.items()}


def _listed(topics: dict[str, str]) -> Message:
    return {"topics": list(topics), "types": list(topics.values())}


def _type_in(types: dict[str, str], values: Message, field: str) -> Message:
    return {"type": types.get(rooted(str(values.get(field, ""))), "")}


def _of(types: dict[str, str], values: Message) -> list[str]:
    """The names with the type that the arguments name."""
    return [name for name, kind in types.items() if kind == values.get("type")]


def _details(kind: str, part: int) -> Callable[[Message, bool], Message]:
    """The handler that tells one part of an interface of that kind."""
    return lambda v, ros2: {"typedefs": interface(str(v.get("type", "")), kind, ros2=ros2)[part].details}


def _param(values: Message, ros2: bool) -> Message:
    """There are no parameters: ROS 1 returns the default, which is JSON as the answer is, or null."""
    if ros2:
        return {"value": "", "successful": False, "reason": "there are no parameters"}
    default: Any = str(values.get("default", ""))
    try:
        msgspec.json.decode(default)
    except (msgspec.DecodeError, RecursionError):
        default = "null" if default == "" else msgspec.json.encode(default).decode()
    return {"value": default}
