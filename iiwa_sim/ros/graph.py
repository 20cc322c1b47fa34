"""The topics, services and the action of a robot, under the names and types of ROS 2.

First what is of Appendix A, then what is of the joint level.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from iiwa_sim.controller.errors import Refused
from iiwa_sim.ros.arm.joint_level import ACTION, ACTION_TYPE, JointLevel
from iiwa_sim.ros.arm.joint_level import PUBLISHED as OF_ARM
from iiwa_sim.ros.arm.joint_level import SUBSCRIBED as TO_ARM
from iiwa_sim.ros.arm.messages import in_ros1, in_ros2
from iiwa_sim.ros.rmi.definitions import message, service
from iiwa_sim.ros.rmi.message_text import BadMessage
from iiwa_sim.ros.rmi.node import PUBLISHED, SUBSCRIBED, Message, Node

Listener = Callable[[Message], None]


class Graph:
    """A robot's topics and services under the names and types of ROS 2."""

    def __init__(self, node: Node, arm: JointLevel) -> None:
        self.node = node
        self.arm = arm
        of_node = {name: _ros2_name(kind, "srv") for name, kind in node.services.items()}
        self.services: dict[str, str] = {**of_node, **arm.services}
        """Type of each service."""
        self.published: dict[str, tuple[str, bool]] = {
            **{topic: (_ros2_name(kind, "msg"), False) for topic, (kind, _) in PUBLISHED.items()},
            **{topic: (kind, rate_hz == 0) for topic, (kind, rate_hz) in OF_ARM.items()},
        }
        """Type of each topic, and whether a subscriber that comes later gets the last message."""
        self.recurring = {topic for topic, (_, rate_hz) in {**OF_ARM, **PUBLISHED}.items() if rate_hz}
        """Topics of which a message may be left out, since the next one says it anew."""
        self.subscribed: dict[str, str] = {
            **{topic: _ros2_name(kind, "msg") for topic, kind in SUBSCRIBED.items()},
            **TO_ARM,
        }
        """Type of each topic that the robot listens to."""
        self.actions: Mapping[str, str] = {ACTION: ACTION_TYPE}
        """Type of each action."""

    def listen(self, topic: str, hear: Listener) -> Callable[[], None]:
        """Have the messages of a topic heard, to be told `in_ros2`; gives what ends that."""
        of = self.node if topic in PUBLISHED else self.arm
        of.listen(topic, hear)
        return partial(of.unlisten, topic, hear)

    def in_ros2(self, topic: str, content: Message) -> Message:
        """A message that was heard, in the form of ROS 2."""
        if topic not in PUBLISHED:
            return content
        return in_ros2(self.node.definition(PUBLISHED[topic][0]), content)

    def receive(self, topic: str, content: Any, who: str) -> None:
        """Take a message for a topic of `subscribed`. Raises BadMessage, and then nothing of it is done."""
        if topic in SUBSCRIBED:
            self.node.receive(topic, in_ros1(message(SUBSCRIBED[topic]), content))
            return
        try:
            self.arm.receive(topic, content, who)
        except Refused as refused:
            raise BadMessage(refused.reason) from None

    def call(self, name: str, request: Any) -> Message:
        """Call a service of `services`; gives the response. Raises BadMessage."""
        if name in self.arm.services:
            return self.arm.call(name, request)
        both = service(self.node.services[name])
        return in_ros2(both.response, self.node.call(name, in_ros1(both.request, request)))


def _ros2_name(kind: str, of: str) -> str:
    """package/msg/Type or package/srv/Type of package/Type."""
    return kind.replace("/", f"/{of}/")
