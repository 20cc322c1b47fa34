"""What a client of rosbridge gets that names types as ROS 2 does, package/msg/Type, or sends goals of
actions.

The protocol is that of rosbridge_suite 2: https://github.com/RobotWebTools/rosbridge_suite. Topics, services
and actions that only ROS 2 has are served in its form to whoever asks for them.
"""

from collections.abc import Callable
from functools import cached_property, partial
from typing import Any

import msgspec
from cbor2 import dumps

from iiwa_sim.controller.errors import Refused
from iiwa_sim.ros.arm.goals import GoalEnd
from iiwa_sim.ros.arm.joint_level import ACTION, ACTION_TYPE, JointLevel
from iiwa_sim.ros.arm.joint_level import PUBLISHED as OF_ARM
from iiwa_sim.ros.arm.joint_level import SUBSCRIBED as TO_ARM
from iiwa_sim.ros.arm.messages import BadGoal, in_ros1, in_ros2, ros1_name
from iiwa_sim.ros.rmi.definitions import message
from iiwa_sim.ros.rmi.node import PUBLISHED, SUBSCRIBED, BadMessage, Message, Node
from iiwa_sim.ros.rosbridge.outbox import Outbox
from iiwa_sim.ros.rosbridge.rosapi_ros2 import Ros2Api

CANCEL_SERVICE = f"{ACTION}/_action/cancel_goal"
"""How roslibjs cancels all goals of an action."""
MOST_GOALS = 100
"""Goals of one client that have not ended: only the newest is followed, so there is one, but for a tick."""
COMPRESSIONS = ("none", "cbor")
_UNKNOWN = 0  # of action_msgs/GoalStatus
_encode = msgspec.json.Encoder().encode


def is_ros2(kind: Any) -> bool:
    """Whether a type is named as ROS 2 does."""
    return isinstance(kind, str) and kind.count("/") == 2


class Ros2Client:
    """One client's topics and goals in the form of ROS 2."""

    def __init__(
        self,
        node: Node,
        arm: JointLevel | None,
        outbox: Outbox,
        reply: Callable[[Message], None],
        name: str,
    ) -> None:
        self._node = node
        self._arm = arm
        self._outbox = outbox
        self._reply = reply
        self._name = name
        self._topics: dict[str, Callable[[], None]] = {}  # how each ends
        self._goals: dict[str, int] = {}  # numbers by the clients' ids
        self._feedback = ""  # the feed of the newest goal's

    def type_of(self, topic: str) -> str | None:
        """The type of a topic that is published, None where nobody publishes it."""
        if self._arm is not None and topic in OF_ARM:
            return OF_ARM[topic][0]
        return PUBLISHED[topic][0] if topic in PUBLISHED else None

    def takes(self, topic: str) -> str | None:
        """The type of a topic that the robot listens to, None where it does not."""
        return TO_ARM.get(topic) if self._arm is not None else None

    def hears(self, topic: str) -> bool:
        """Whether the client is subscribed to it in this form."""
        return topic in self._topics

    def subscribe(
        self, topic: str, name: str, throttle_s: float, queue_length: int, compression: str
    ) -> None:
        """Send the messages of a topic, which somebody publishes, under the name by which the client knows
        it.

        A second subscription takes the place of the first.
        """
        self.unsubscribe(topic)
        kind, own = self.type_of(topic), self._key(topic)
        assert kind is not None
        self._outbox.set_feed(own, throttle_s, queue_length)

        def framed(content: Message) -> str | bytes:
            told = {"op": "publish", "topic": name, "msg": content}
            return dumps(told) if compression == "cbor" else _encode(told).decode()

        def hear(content: Message) -> None:
            self._outbox.feed(own, partial(framed, content))

        if self._arm is not None and topic in OF_ARM:
            arm = self._arm
            arm.listen(topic, hear)
            self._topics[topic] = partial(arm.unlisten, topic, hear)
            return
        definition = self._node.definition(kind)

        def hear_node(content: Message) -> None:
            self._outbox.feed(own, lambda: framed(in_ros2(definition, content)))

        self._node.listen(topic, hear_node)
        self._topics[topic] = partial(self._node.unlisten, topic, hear_node)

    def unsubscribe(self, topic: str) -> None:
        """Send no more of them, if any were sent."""
        end = self._topics.pop(topic, None)
        if end is not None:
            end()
            self._outbox.end_feed(self._key(topic))

    def publish(self, topic: str, content: Any) -> None:
        """Take a message for a topic the robot listens to. Raises `BadMessage`."""
        if topic in SUBSCRIBED:
            self._node.receive(topic, in_ros1(message(ros1_name(SUBSCRIBED[topic])), content))
            return
        assert self._arm is not None
        try:
            self._arm.receive(topic, content, self._name)
        except BadGoal as fault:
            raise BadMessage(str(fault)) from None
        except Refused as refused:
            raise BadMessage(refused.reason) from None

    def send_goal(self, asked: Message) -> None:
        """Follow a trajectory; everything that is told of it, also a refusal, is an `action_result`."""
        action, identifier = asked.get("action"), asked.get("id")

        def result(values: Any, status: int, *, ran: bool) -> None:
            told = {
                "op": "action_result",
                "action": action,
                "values": values,
                "status": status,
                "result": ran,
            }
            self._reply(told if identifier is None else {**told, "id": identifier})

        def ended(end: GoalEnd) -> None:
            self._goals.pop(str(identifier), None)
            self._outbox.end_feed(feed)  # clients take feedback behind the result for a fault
            result(end.result, end.status, ran=True)

        def hear(values: Message) -> None:
            told = {"op": "action_feedback", "action": action, "values": values}
            frame = _encode(told if identifier is None else {**told, "id": identifier}).decode()
            self._outbox.feed(feed, lambda: frame)

        feed = f"feedback {identifier}"
        wrong = self._fault_of(asked)
        if wrong is not None:
            result(wrong, _UNKNOWN, ran=False)
            return
        assert self._arm is not None
        wanted = bool(asked.get("feedback", False))
        try:
            number = self._arm.send_goal(asked.get("args", {}), ended, hear if wanted else None, self._name)
        except (BadGoal, Refused) as fault:
            reason = fault.reason if isinstance(fault, Refused) else str(fault)
            result(f"Action goal was rejected: {reason}", _UNKNOWN, ran=False)
            return
        self._goals[str(identifier)] = number
        if wanted:
            self._outbox.end_feed(self._feedback)
            self._feedback = feed
            self._outbox.set_feed(feed, 0.0, 1)

    def cancel_goal(self, asked: Message) -> str | None:
        """Cancel a goal of this client; gives what is wrong, None where nothing is."""
        number = self._goals.get(str(asked.get("id")))
        if number is None or self._arm is None:
            return "there is no such goal, or it has ended"
        self._arm.cancel(number)
        return None

    def end(self) -> None:
        """The client has gone. Its goal goes on, as everywhere in ROS."""
        for topic in list(self._topics):
            self.unsubscribe(topic)
        for number in self._goals.values():
            if self._arm is not None:
                self._arm.forget(number)

    def _fault_of(self, asked: Message) -> str | None:
        name = asked.get("action")
        if not isinstance(name, str) or f"/{name.lstrip('/')}" != ACTION or self._arm is None:
            here = "none" if self._arm is None else ACTION
            return f"there is no action {str(name)[:100]}: expected {here}"
        if asked.get("action_type") not in (None, "", ACTION_TYPE, ros1_name(ACTION_TYPE)):
            return f"{ACTION} is of type {ACTION_TYPE}"
        if len(self._goals) >= MOST_GOALS or str(asked.get("id")) in self._goals:
            return "expected an id of its own"
        return None

    @cached_property
    def api(self) -> Ros2Api:
        """What there is, in the words of ROS 2."""
        return Ros2Api(self._node, self._arm)

    @staticmethod
    def _key(topic: str) -> str:
        return f"ros2 {topic}"
