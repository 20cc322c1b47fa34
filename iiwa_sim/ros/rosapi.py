"""The introspection services for clients of rosbridge: those of the package rosapi, of ROS 1 and of ROS 2.

https://github.com/RobotWebTools/rosbridge_suite/tree/ros2/rosapi
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import msgspec

from iiwa_sim.ros.graph import Graph, Served, Topic
from iiwa_sim.ros.joint_interface import ACTION, ACTION_TYPE
from iiwa_sim.ros.messages import Message, interface, short_name, to_ros1

NODE = "/iiwa_sim"
PREFIX = "/rosapi/"
ACTION_SERVERS = f"{PREFIX}action_servers"
NO_PARAMETERS = {"successful": False, "reason": "there are no parameters"}


class Api(NamedTuple):
    """A service of rosapi."""

    kind: str
    """Its type without the package."""
    arguments: tuple[str, ...]
    answer: Callable[[Message, bool], Message]
    """Takes arguments, and whether the client speaks ROS 2. KeyError names what does not exist."""
    only_ros2: bool = False


def rooted(name: str) -> str:
    """Return a name with its leading slash, which many clients leave out."""
    return name if name.startswith("/") else f"/{name}"


class RosApi:
    """Answers questions about one node and its graph."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        topic, service, kind, action = ("topic",), ("service",), ("type",), ("action",)
        self.services: dict[str, Api] = {
            "topics": Api("Topics", (), lambda _, ros2: _listed(self._topics(ros2))),
            "topics_and_raw_types": Api("TopicsAndRawTypes", (), self._raw_types),
            "topic_type": Api("TopicType", topic, lambda v, ros2: _type_in(self._topics(ros2), v, "topic")),
            "topics_for_type": Api("TopicsForType", kind, lambda v, r: {"topics": _of(self._topics(r), v)}),
            "services": Api("Services", (), lambda _, ros2: {"services": list(self._services(ros2))}),
            "service_type": Api(
                "ServiceType", service, lambda v, ros2: _type_in(self._services(ros2), v, "service")
            ),
            "services_for_type": Api(
                "ServicesForType", kind, lambda v, ros2: {"services": _of(self._services(ros2), v)}
            ),
            "service_node": Api("ServiceNode", service, self._service_node, True),
            "service_providers": Api("ServiceProviders", service, self._service_providers, True),
            "nodes": Api("Nodes", (), lambda _, __: {"nodes": [NODE]}),
            "node_details": Api("NodeDetails", ("node",), self._node_details),
            "publishers": Api(
                "Publishers", topic, lambda v, _: {"publishers": _if_in(graph.published, v, "topic")}
            ),
            "subscribers": Api(
                "Subscribers", topic, lambda v, _: {"subscribers": _if_in(graph.subscribed, v, "topic")}
            ),
            "message_details": Api("MessageDetails", kind, _details("msg", 0)),
            "service_request_details": Api("ServiceRequestDetails", kind, _details("srv", 0)),
            "service_response_details": Api("ServiceResponseDetails", kind, _details("srv", 1)),
            "action_servers": Api("GetActionServers", (), lambda _, __: {"action_servers": [ACTION]}),
            "action_type": Api(
                "ActionType", action, lambda v, _: _type_in({ACTION: ACTION_TYPE}, v, "action"), True
            ),
            "action_goal_details": Api("ActionGoalDetails", kind, _details("action", 0), True),
            "action_result_details": Api("ActionResultDetails", kind, _details("action", 1), True),
            "action_feedback_details": Api("ActionFeedbackDetails", kind, _details("action", 2), True),
            "interfaces": Api("Interfaces", (), self._interfaces, True),
            "get_time": Api("GetTime", (), self._time),
            "get_ros_version": Api("GetROSVersion", (), lambda _, __: {"version": 2, "distro": ""}, True),
            "get_param_names": Api("GetParamNames", (), lambda _, __: {"names": []}),
            "has_param": Api("HasParam", ("name",), lambda _, __: {"exists": False}),
            "get_param": Api("GetParam", ("name", "default"), _param),
            "set_param": Api("SetParam", ("name", "value"), lambda _, __: NO_PARAMETERS, True),
            "delete_param": Api("DeleteParam", ("name",), lambda _, __: NO_PARAMETERS, True),
        }

    def _topics(self, ros2: bool) -> dict[str, str]:
        return {**_told(self._graph.published, ros2), **_told(self._graph.subscribed, ros2)}

    def _services(self, ros2: bool) -> dict[str, str]:
        package = "rosapi_msgs/srv" if ros2 else "rosapi"
        here = {
            f"{PREFIX}{name}": f"{package}/{each.kind}"
            for name, each in self.services.items()
            if ros2 or not each.only_ros2
        }
        return {**_told(self._graph.services, ros2), **here}

    def _raw_types(self, _: Message, ros2: bool) -> Message:
        topics = self._topics(ros2)
        texts = [interface(kind, "msg", ros2=ros2)[0].full_text for kind in topics.values()]
        return {**_listed(topics), "typedefs_full_text": texts}

    def _service_node(self, values: Message, ros2: bool) -> Message:
        return {"node": "".join(_if_in(self._services(ros2), values, "service"))}

    def _service_providers(self, values: Message, ros2: bool) -> Message:
        return {"providers": _if_in(self._services(ros2), values, "service")}

    def _node_details(self, values: Message, ros2: bool) -> Message:
        told = {
            "publishing": _told(self._graph.published, ros2),
            "subscribing": _told(self._graph.subscribed, ros2),
            "services": self._services(ros2),
        }
        ours = _named(values, "node") == NODE
        return {name: list(each) if ours else [] for name, each in told.items()}

    def _interfaces(self, _: Message, ros2: bool) -> Message:
        kinds = {*self._topics(ros2).values(), *self._services(ros2).values(), ACTION_TYPE}
        return {"interfaces": sorted(kinds)}

    def _time(self, _: Message, ros2: bool) -> Message:
        return {"time": self._graph.stamp if ros2 else to_ros1(self._graph.stamp)}


def _told(named: Mapping[str, Topic] | Mapping[str, Served], ros2: bool) -> dict[str, str]:
    """The types by name, as a client of that ROS knows them."""
    return {
        name: each.kind if ros2 else short_name(each.kind)
        for name, each in named.items()
        if ros2 or each.in_ros1
    }


def _listed(topics: dict[str, str]) -> Message:
    return {"topics": list(topics), "types": list(topics.values())}


def _named(values: Message, field: str) -> str:
    return rooted(str(values.get(field, "")))


def _type_in(types: dict[str, str], values: Message, field: str) -> Message:
    return {"type": types.get(_named(values, field), "")}


def _of(types: dict[str, str], values: Message) -> list[str]:
    """The names with the type that the arguments name."""
    return [name for name, kind in types.items() if kind == values.get("type")]


def _if_in(names: Iterable[str], values: Message, field: str) -> list[str]:
    """The node, where what the arguments name is one of these."""
    return [NODE] if _named(values, field) in names else []


def _details(kind: str, number: int) -> Callable[[Message, bool], Message]:
    """The handler that tells one part of an interface of that kind."""
    return lambda values, ros2: {
        "typedefs": interface(str(values.get("type", "")), kind, ros2=ros2)[number].details
    }


def _param(values: Message, ros2: bool) -> Message:
    """There are no parameters: ROS 1 returns the default, which is JSON as the answer is, or null."""
    if ros2:
        return {"value": "", **NO_PARAMETERS}
    default: Any = str(values.get("default", ""))
    try:
        msgspec.json.decode(default)
    except (msgspec.DecodeError, RecursionError):
        default = "null" if default == "" else msgspec.json.encode(default).decode()
    return {"value": default}
