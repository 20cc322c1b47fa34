"""What of a robot is on the graph of ROS 2: topics, services and the action, as messages in its form.

Of Appendix A and of the joint level both; where both have a topic, it is Appendix A's.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from iiwa_sim.controller.errors import Refused
from iiwa_sim.ros.arm.joint_level import ACTION, ACTION_TYPE, JointLevel
from iiwa_sim.ros.arm.joint_level import PUBLISHED as OF_ARM
from iiwa_sim.ros.arm.joint_level import SUBSCRIBED as TO_ARM
from iiwa_sim.ros.arm.messages import BadGoal, in_ros1, in_ros2, ros1_name
from iiwa_sim.ros.rmi.definitions import message, service
from iiwa_sim.ros.rmi.node import PUBLISHED, SUBSCRIBED, BadMessage, Message, Node
from iiwa_sim.ros.rmi.rates import Rates

Answer = Callable[[Message], None]
Fail = Callable[[str], None]

RATES = "rates."
"""What the names of parameters begin with; a topic follows."""
ACTIONS: Mapping[str, str] = {ACTION: ACTION_TYPE}


class Graph:
    """A robot's topics and services under the names and types of ROS 2."""

    def __init__(self, node: Node, arm: JointLevel) -> None:
        self._node = node
        self._arm = arm
        self.published: dict[str, tuple[str, bool]] = {
            **{topic: (kind, rate_hz == 0) for topic, (kind, rate_hz) in arm.published.items()},
            **{topic: (_ros2_name(kind, "msg"), False) for topic, (kind, _) in PUBLISHED.items()},
        }
        """Type of each topic, and whether a subscriber that comes later gets the last message."""
        self.recurring = {
            *(topic for topic, (_, rate_hz) in OF_ARM.items() if rate_hz),
            *(topic for topic, (_, rate_hz) in PUBLISHED.items() if rate_hz),
        }
        """Topics of which a message may be left out, since the next one says it anew."""
        self.subscribed: dict[str, str] = {
            **TO_ARM,
            **{topic: _ros2_name(kind, "msg") for topic, kind in SUBSCRIBED.items()},
        }

    @property
    def services(self) -> dict[str, str]:
        """Type of each service."""
        of_node = {name: _ros2_name(kind, "srv") for name, kind in self._node.services.items()}
        return {**self._arm.services, **of_node}

    @property
    def parameters(self) -> list[tuple[str, int, int, int]]:
        """The node's parameters, which are rates (Hz): name, value, lowest and highest value."""
        return [
            (f"{RATES}{topic.strip('/')}", rate_hz, 1, rates.highest_hz)
            for rates in self._rates()
            for topic, rate_hz in rates.rates_hz.items()
            if topic in self.published
        ]

    def set_parameter(self, name: str, value: float) -> None:
        """One of them has been set."""
        for rates in self._rates():
            rates.set(f"/{name.removeprefix(RATES)}", value)

    def _rates(self) -> tuple[Rates, Rates]:
        return self._node.rates, self._arm.rates

    def listen(self, topic: str, hear: Answer) -> Callable[[], None]:
        """Have the messages of a topic heard; gives what ends that."""
        if topic not in PUBLISHED:
            self._arm.listen(topic, hear)
            return partial(self._arm.unlisten, topic, hear)
        definition = self._node.definition(PUBLISHED[topic][0])

        def hear_node(content: Message) -> None:
            hear(in_ros2(definition, content))

        self._node.listen(topic, hear_node)
        return partial(self._node.unlisten, topic, hear_node)

    def refusal_of(self, topic: str, content: Any, who: str) -> str | None:
        """Take a message; gives why it is refused, None where it is not."""
        try:
            if topic in SUBSCRIBED:
                self._node.receive(topic, in_ros1(message(ros1_name(SUBSCRIBED[topic])), content))
            else:
                self._arm.receive(topic, content, who)
        except (BadGoal, BadMessage) as fault:
            return str(fault)
        except Refused as refused:
            return refused.reason
        return None

    def call(self, name: str, request: Any, answer: Answer, fail: Fail) -> None:
        """Call a service; either `answer` or `fail` is called once, now or later."""
        request = {key: value for key, value in request.items() if key != EMPTY}
        try:
            if name in self._arm.services:
                self._arm.call(name, request, answer)
                return
            both = service(self._node.services[name])
            respond = _in_ros2(both.response, answer)
            self._node.call(name, in_ros1(both.request, request), respond, fail)
        except (BadGoal, BadMessage) as fault:
            fail(str(fault))


EMPTY = "structure_needs_at_least_one_member"
"""A field that rclpy shows of messages without any."""


def _ros2_name(kind: str, of: str) -> str:
    package, _, own = kind.partition("/")
    return f"{package}/{of}/{own}"


def _in_ros2(definition: Any, answer: Answer) -> Answer:
    return lambda response: answer(in_ros2(definition, response))
