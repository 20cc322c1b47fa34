"""The introspection services in the words of ROS 2: those of rosbridge_suite 2's package rosapi.

https://github.com/RobotWebTools/rosbridge_suite/tree/ros2/rosapi
"""

from collections.abc import Callable

from iiwa_sim.ros.arm.interfaces import details, full_text, interface, split
from iiwa_sim.ros.arm.messages import time_of
from iiwa_sim.ros.graph import Graph
from iiwa_sim.ros.rmi.node import Node
from iiwa_sim.ros.rosbridge.introspection import KIND, NODE, SERVICE, Introspection, Row, Values, named

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


class Ros2Api(Introspection):
    """Answers about one node. A call takes arguments as they come; KeyError names what does not exist."""

    def __init__(self, graph: Graph) -> None:
        published = {name: kind for name, (kind, _) in graph.published.items()}
        self._actions = graph.actions
        own: dict[str, Row] = {
            "interfaces": ("Interfaces", (), lambda _: {"interfaces": self._interfaces()}),
            "service_node": ("ServiceNode", SERVICE, lambda v: {"node": "".join(self._serving(v))}),
            "service_providers": ("ServiceProviders", SERVICE, lambda v: {"providers": self._serving(v)}),
            "action_servers": (
                "GetActionServers",
                (),
                lambda _: {"action_servers": list(self._actions)},
            ),
            "action_type": (
                "ActionType",
                ("action",),
                lambda v: {"type": self._actions.get(named(v, "action"), "")},
            ),
            "message_details": ("MessageDetails", KIND, _details("msg", 0)),
            "service_request_details": ("ServiceRequestDetails", KIND, _details("srv", 0)),
            "service_response_details": ("ServiceResponseDetails", KIND, _details("srv", 1)),
            "action_goal_details": ("ActionGoalDetails", KIND, _details("action", 0)),
            "action_result_details": ("ActionResultDetails", KIND, _details("action", 1)),
            "action_feedback_details": ("ActionFeedbackDetails", KIND, _details("action", 2)),
            "get_time": ("GetTime", (), lambda _: {"time": _time(graph.node)}),
            "get_ros_version": ("GetROSVersion", (), lambda _: {"version": VERSION, "distro": ""}),
            "get_param": ("GetParam", ("name",), lambda _: {"value": "", **NO_PARAMETERS}),
            "set_param": ("SetParam", ("name", "value"), lambda _: NO_PARAMETERS),
            "delete_param": ("DeleteParam", ("name",), lambda _: NO_PARAMETERS),
        }
        super().__init__(published, graph.subscribed, graph.services, full_text, "rosapi_msgs/srv", own)

    def _interfaces(self) -> list[str]:
        return sorted({*self.topics.values(), *self.services.values(), *self._actions.values()})

    def _serving(self, values: Values) -> list[str]:
        return [NODE] if named(values, "service") in self.services else []


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
