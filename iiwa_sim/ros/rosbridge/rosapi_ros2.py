"""The introspection services in the words of ROS 2: those of rosbridge_suite 2's package rosapi.

https://github.com/RobotWebTools/rosbridge_suite/tree/ros2/rosapi
"""

from collections.abc import Callable

from iiwa_sim.ros.arm.joint_level import ACTION, ACTION_TYPE, JointLevel
from iiwa_sim.ros.arm.joint_level import PUBLISHED as OF_ARM
from iiwa_sim.ros.arm.joint_level import SUBSCRIBED as TO_ARM
from iiwa_sim.ros.arm.messages import time_of
from iiwa_sim.ros.rmi.node import PUBLISHED, SUBSCRIBED, Node
from iiwa_sim.ros.rosbridge.interfaces import details, full_text, interface, split
from iiwa_sim.ros.rosbridge.rosapi import NODE, Call, Values, named, of_type, rooted

VERSION = 2
NO_PARAMETERS = {"successful": False, "reason": "there are no parameters"}
ACTION_SERVERS = "/rosapi/action_servers"
ONLY_HERE = frozenset(
    f"/rosapi/{name}"
    for name in (
        "action_feedback_details",
        "action_goal_details",
        "action_result_details",
        "action_type",
        "get_ros_version",
        "interfaces",
    )
)
"""Services of which ROS 1 has none: who calls one of them speaks ROS 2."""


class Ros2Api:
    """Answers about one node. A call takes arguments as they come; KeyError names what does not exist."""

    def __init__(self, node: Node, arm: JointLevel | None) -> None:
        self._node = node
        self._published = {name: _in_ros2(kind, "msg") for name, (kind, _) in PUBLISHED.items()}
        self._subscribed = {name: _in_ros2(kind, "msg") for name, kind in SUBSCRIBED.items()}
        served = {name: _in_ros2(kind, "srv") for name, kind in node.services.items()}
        if arm is not None:
            self._published |= {name: kind for name, (kind, _) in OF_ARM.items()}
            self._subscribed |= TO_ARM
            served |= arm.services
        self._actions = {} if arm is None else {ACTION: ACTION_TYPE}
        self._topics = self._published | self._subscribed
        topic, service, action, kind = ("topic",), ("service",), ("action",), ("type",)
        calls: dict[str, tuple[str, tuple[str, ...], Call]] = {
            "topics": ("Topics", (), lambda _: self._topics_and_types()),
            "topics_and_raw_types": ("TopicsAndRawTypes", (), lambda _: self._topics_and_raw_types()),
            "topic_type": ("TopicType", topic, lambda v: {"type": self._topics.get(named(v, "topic"), "")}),
            "topics_for_type": ("TopicsForType", kind, lambda v: {"topics": of_type(self._topics, v)}),
            "interfaces": ("Interfaces", (), lambda _: {"interfaces": self._interfaces()}),
            "services": ("Services", (), lambda _: {"services": list(self._services)}),
            "services_for_type": (
                "ServicesForType",
                kind,
                lambda v: {"services": of_type(self._services, v)},
            ),
            "service_type": (
                "ServiceType",
                service,
                lambda v: {"type": self._services.get(named(v, "service"), "")},
            ),
            "service_node": ("ServiceNode", service, lambda v: {"node": "".join(self._serving(v))}),
            "service_providers": ("ServiceProviders", service, lambda v: {"providers": self._serving(v)}),
            "nodes": ("Nodes", (), lambda _: {"nodes": [NODE]}),
            "node_details": ("NodeDetails", ("node",), self._node_details),
            "publishers": ("Publishers", topic, lambda v: {"publishers": _if(v, self._published)}),
            "subscribers": ("Subscribers", topic, lambda v: {"subscribers": _if(v, self._subscribed)}),
            "action_servers": (
                "GetActionServers",
                (),
                lambda _: {"action_servers": list(self._actions)},
            ),
            "action_type": (
                "ActionType",
                action,
                lambda v: {"type": self._actions.get(named(v, "action"), "")},
            ),
            "message_details": ("MessageDetails", kind, _details("msg", 0)),
            "service_request_details": ("ServiceRequestDetails", kind, _details("srv", 0)),
            "service_response_details": ("ServiceResponseDetails", kind, _details("srv", 1)),
            "action_goal_details": ("ActionGoalDetails", kind, _details("action", 0)),
            "action_result_details": ("ActionResultDetails", kind, _details("action", 1)),
            "action_feedback_details": ("ActionFeedbackDetails", kind, _details("action", 2)),
            "get_time": ("GetTime", (), lambda _: {"time": _time(node)}),
            "get_ros_version": ("GetROSVersion", (), lambda _: {"version": VERSION, "distro": ""}),
            "get_param_names": ("GetParamNames", (), lambda _: {"names": []}),
            "has_param": ("HasParam", ("name",), lambda _: {"exists": False}),
            "get_param": ("GetParam", ("name",), lambda _: {"value": "", **NO_PARAMETERS}),
            "set_param": ("SetParam", ("name", "value"), lambda _: NO_PARAMETERS),
            "delete_param": ("DeleteParam", ("name",), lambda _: NO_PARAMETERS),
        }
        self.calls = {f"/rosapi/{name}": (names, call) for name, (_, names, call) in calls.items()}
        """Argument names and handler of each service."""
        self._services = {
            **served,
            **{f"/rosapi/{name}": f"rosapi_msgs/srv/{kind}" for name, (kind, _, _) in calls.items()},
        }

    def _topics_and_types(self) -> Values:
        return {"topics": list(self._topics), "types": list(self._topics.values())}

    def _topics_and_raw_types(self) -> Values:
        return {**self._topics_and_types(), "typedefs_full_text": list(map(full_text, self._topics.values()))}

    def _interfaces(self) -> list[str]:
        return sorted({*self._topics.values(), *self._services.values(), *self._actions.values()})

    def _serving(self, values: Values) -> list[str]:
        return [NODE] if rooted(str(values.get("service", ""))) in self._services else []

    def _node_details(self, values: Values) -> Values:
        here = named(values, "node") == NODE
        return {
            "publishing": list(self._published) if here else [],
            "subscribing": list(self._subscribed) if here else [],
            "services": list(self._services) if here else [],
        }


def _in_ros2(kind: str, between: str) -> str:
    """package/msg/Type or package/srv/Type of package/Type."""
    return kind.replace("/", f"/{between}/")


def _if(values: Values, topics: dict[str, str]) -> list[str]:
    return [NODE] if named(values, "topic") in topics else []


def _time(node: Node) -> dict[str, int]:
    now = node.time()
    return time_of(now["secs"] * 10**9 + now["nsecs"])


def _details(kind: str, number: int) -> Callable[[Values], Values]:
    """The handler that tells one part of an interface of that kind."""

    def tell(values: Values) -> Values:
        name = str(values.get("type", ""))
        package, found, own = split(name)
        if name.count("/") == 1:
            found = kind  # rosapi takes the short name, too
        if found != kind:
            raise KeyError(name)
        return {"typedefs": details(interface(f"{package}/{kind}/{own}")[number])}

    return tell
