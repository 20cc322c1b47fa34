"""What a client of rosbridge gets that names types as ROS 2 does, package/msg/Type, or sends goals of
actions.

The protocol is that of rosbridge_suite 2: https://github.com/RobotWebTools/rosbridge_suite. Topics, services
and actions that only ROS 2 has are served in its form to whoever asks for them.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import msgspec
from cbor2 import dumps

from iiwa_sim.controller.errors import Refused
from iiwa_sim.ros.arm.goals import GoalEnd
from iiwa_sim.ros.arm.joint_level import ACTION, ACTION_TYPE
from iiwa_sim.ros.arm.messages import ros1_name
from iiwa_sim.ros.graph import Graph
from iiwa_sim.ros.rmi.message_text import BadMessage
from iiwa_sim.ros.rmi.node import Message
from iiwa_sim.ros.rosbridge.outbox import Outbox

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
        graph: Graph,
        outbox: Outbox,
        reply: Callable[[Message], None],
        name: str,
    ) -> None:
        self._graph = graph
        self._outbox = outbox
        self._reply = reply
        self._name = name
        self._topics: dict[str, Callable[[], None]] = {}  # how each ends
        self._goals: dict[str, int] = {}  # numbers by the clients' ids
        self._feedback = ""  # the feed of the newest goal's

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
        own = self._key(topic)
        self._outbox.set_feed(own, throttle_s, queue_length)

        def framed(content: Message) -> str | bytes:
            told = {"op": "publish", "topic": name, "msg": self._graph.in_ros2(topic, content)}
            return dumps(told) if compression == "cbor" else _encode(told).decode()

        self._topics[topic] = self._graph.listen(
            topic, lambda content: self._outbox.feed(own, partial(framed, content))
        )

    def unsubscribe(self, topic: str) -> None:
        """Send no more of them, if any were sent."""
        end = self._topics.pop(topic, None)
        if end is not None:
            end()
            self._outbox.end_feed(self._key(topic))

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
        wanted = bool(asked.get("feedback", False))
        try:
            number = self._graph.arm.send_goal(
                asked.get("args", {}), ended, hear if wanted else None, self._name
            )
        except (BadMessage, Refused) as fault:
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
        if number is None:
            return "there is no such goal, or it has ended"
        self._graph.arm.cancel(number)
        return None

    def end(self) -> None:
        """The client has gone. Its goal goes on, as everywhere in ROS."""
        for topic in list(self._topics):
            self.unsubscribe(topic)
        for number in self._goals.values():
            self._graph.arm.forget(number)

    def _fault_of(self, asked: Message) -> str | None:
        name = asked.get("action")
        if not isinstance(name, str) or f"/{name.lstrip('/')}" != ACTION:
            return f"there is no action {str(name)[:100]}: expected {ACTION}"
        if asked.get("action_type") not in (None, "", ACTION_TYPE, ros1_name(ACTION_TYPE)):
            return f"{ACTION} is of type {ACTION_TYPE}"
        if len(self._goals) >= MOST_GOALS or str(asked.get("id")) in self._goals:
            return "expected an id of its own"
        return None

    @staticmethod
    def _key(topic: str) -> str:
        return f"ros2 {topic}"
