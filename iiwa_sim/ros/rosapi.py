"""The introspection services for clients of rosbridge: those of the package rosapi, of ROS 1 and of ROS 2.

https://github.com/RobotWebTools/rosbridge_suite/tree/ros2/rosapi
"""

from collections.abc import Callable, Mapping
from typing import Any

from iiwa_sim.ros.graph import Graph, Served, Topic
from iiwa_sim.ros.joint_interface import ACTION
from iiwa_sim.ros.messages import Message, interface, short_name, to_ros1

NODE = "/iiwa_sim"
ROS_VERSION = "/rosapi/get_ros_version"

Types = dict[str, str]
"""Types by the names of topics or services."""


def rooted(name: str) -> str:
    """Return a name with its leading slash, which many clients leave out."""
    return name if name.startswith("/") else f"/{name}"


class RosApi:
    """Answers questions about one node and its graph."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._answers: dict[str, Callable[[str, bool], Message]] = {
            "topics": lambda _, ros2: _listed(self._topics(ros2)),
            "topic_type": lambda name, ros2: {"type": self._topics(ros2).get(rooted(name), "")},
            "topics_for_type": lambda kind, ros2: {"topics": _of(self._topics(ros2), kind)},
            "services": lambda _, ros2: {"services": [*self._services(ros2), *self.services]},
            "service_type": lambda name, ros2: {"type": self._services(ros2).get(rooted(name), "")},
            "services_for_type": lambda kind, ros2: {"services": _of(self._services(ros2), kind)},
            "nodes": lambda _, __: {"nodes": [NODE]},
            "message_details": lambda kind, _: _details(kind, "msg", 0),
            "service_request_details": lambda kind, _: _details(kind, "srv", 0),
            "service_response_details": lambda kind, _: _details(kind, "srv", 1),
            "action_servers": lambda _, __: {"action_servers": [ACTION]},
            "get_time": lambda _, ros2: {"time": graph.stamp if ros2 else to_ros1(graph.stamp)},
            "get_ros_version": lambda _, __: {"version": 2, "distro": ""},
            "get_param_names": lambda _, __: {"names": []},
            "has_param": lambda _, __: {"exists": False},
            "get_param": lambda _, __: {"value": "null"},
        }
        self.services = [f"/rosapi/{name}" for name in self._answers]

    def answer(self, service: str, arguments: Any, ros2: bool) -> Message:
        """Return a response. Raises KeyError with the name of a service or type that does not exist."""
        if service not in self.services:
            raise KeyError(service)
        return self._answers[service.removeprefix("/rosapi/")](argument_of(arguments), ros2)

    def _topics(self, ros2: bool) -> Types:
        return {**_told(self._graph.published, ros2), **_told(self._graph.subscribed, ros2)}

    def _services(self, ros2: bool) -> Types:
        return _told(self._graph.services, ros2)


def argument_of(arguments: Any) -> str:
    """Return the first argument of a call: no service of rosapi here needs another."""
    values = [*arguments.values()] if isinstance(arguments, dict) else arguments
    return values[0] if isinstance(values, list) and values and isinstance(values[0], str) else ""


def _told(named: Mapping[str, Topic] | Mapping[str, Served], ros2: bool) -> Types:
    """The types by name, as a client of that ROS knows them."""
    shown = {name: each for name, each in named.items() if ros2 or each.in_ros1}
    return {name: each.kind if ros2 else short_name(each.kind) for name, each in shown.items()}


def _listed(topics: Types) -> Message:
    return {"topics": list(topics), "types": list(topics.values())}


def _of(types: Types, wanted: str) -> list[str]:
    return [name for name, kind in types.items() if kind == wanted]


def _details(name: str, kind: str, part: int) -> Message:
    return {"typedefs": interface(name, kind)[part].details}
