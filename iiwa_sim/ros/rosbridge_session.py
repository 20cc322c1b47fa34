"""One client of rosbridge: the operations of protocol v2, JSON in and out, no sockets.

The protocol: https://github.com/RobotWebTools/rosbridge_suite, ROSBRIDGE_PROTOCOL.md. An operation that is
not allowed or not possible is answered by a `status` of level `error` that echoes its `id`, and changes
nothing. A client that disconnects does not stop the robot: it is one of many publishers, as usual in ROS.

A client that sends a goal, or names a type as package/msg/Type, gets all further messages in the form
of ROS 2. Topics that ROS 1 does not have are always in that form.
"""

from collections.abc import Callable
from typing import Any

import msgspec

from iiwa_sim.controller.errors import COMMUNICATION_FAILURE
from iiwa_sim.log import SessionLog
from iiwa_sim.ros.appendix_a import COMMAND_RESULT
from iiwa_sim.ros.graph import ROS_VERSION, Endpoint, Graph, Topic, rooted, rosapi
from iiwa_sim.ros.joint_interface import ACTION, ACTION_TYPE, JointInterface
from iiwa_sim.ros.messages import BadMessage, Message, from_ros1, short_name, to_ros1
from iiwa_sim.ros.outbox import LONGEST_FEED, Outbox
from iiwa_sim.wording import harmless, shortened

CANCEL_SERVICE = f"{ACTION}/_action/cancel_goal"
"""How roslibjs cancels all goals of an action."""
_UNKNOWN = 0  # of action_msgs/GoalStatus


class _Identified(msgspec.Struct):
    id: str | int | float | None = None


class _Operation(_Identified):
    """A requested operation, with the fields of all kinds."""

    op: str = ""
    topic: str = ""
    type: str | None = None
    msg: Any = {}
    throttle_rate: float | None = None
    queue_length: float | None = None
    service: str = ""
    action: str = ""
    action_type: str | None = None
    args: Any = None
    feedback: bool | None = None


class RosbridgeSession:
    """One client's messages in, and replies and topics out through its outbox."""

    def __init__(
        self, graph: Graph, joints: JointInterface, outbox: Outbox, log: SessionLog, name: str
    ) -> None:
        self._graph, self._joints, self._outbox = graph, joints, outbox
        self._log, self._name = log, name
        self._speaks_ros2 = False
        self._subscriptions: dict[str, set[Any]] = {}  # the client's ids by topic
        self._ends: dict[str, Callable[[], None]] = {}
        self._goals: dict[str, int] = {}  # numbers by the client's ids
        self._operations: dict[str, Callable[[_Operation], None]] = {
            "advertise": self._advertise,
            "publish": self._publish,
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "call_service": self._call_service,
            "send_action_goal": self._send_goal,
            "cancel_action_goal": self._cancel_goal,
            **dict.fromkeys(("unadvertise", "auth", "set_level", "status"), lambda _: None),
        }

    def receive(self, text: bytes, decode: Callable[[bytes], Any] = msgspec.json.decode) -> None:
        """Handle one message of the client, a JSON object."""
        asked = _Operation()
        try:
            fields = decode(text)
            asked.id = msgspec.convert(fields, _Identified).id  # the answer has it whatever else is wrong
            asked = msgspec.convert(fields, _Operation)
            if asked.op not in self._operations:
                raise BadMessage(f"op {_shown(asked.op)}: expected {', '.join(self._operations)}")
            self._operations[asked.op](asked)
            return
        except (BadMessage, msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as fault:
            reason = str(fault)
            self._log.refused(self._name, _shown(text), COMMUNICATION_FAILURE, reason)
        except Exception as fault:  # noqa: BLE001  # an internal error must not cost the client its connection
            reason = "internal error, see the log"
            self._log.exception(self._name, _shown(text), fault)
        self._reply(asked, {"op": "status", "level": "error", "msg": reason})

    def end(self) -> None:
        """Notice that the client has gone. Its goal continues, as everywhere in ROS."""
        for end in self._ends.values():
            end()

    def _reply(self, asked: _Operation, message: Message) -> None:
        self._outbox.reply(_encoded(message if asked.id is None else {**message, "id": asked.id}))

    def _notice(self, kind: str | None) -> None:
        """Notice the name of a type: only ROS 2 says package/msg/Type."""
        self._speaks_ros2 |= kind is not None and short_name(kind) != kind

    def _in_ros2(self, named: Topic | Endpoint) -> bool:
        """Return True if the client gets and sends its messages in the form of ROS 2."""
        return self._speaks_ros2 or not named.in_ros1

    # Topics

    def _advertise(self, asked: _Operation) -> None:
        self._notice(asked.type)
        _check_type(asked.topic, self._subscribed(asked.topic).kind, asked.type)

    def _subscribed(self, topic: str) -> Endpoint:
        """Return a topic that the robot subscribes to."""
        if rooted(topic) not in self._graph.subscribed:
            raise BadMessage(f"no subscriber of {topic}: expected {', '.join(self._graph.subscribed)}")
        return self._graph.subscribed[rooted(topic)]

    def _publish(self, asked: _Operation) -> None:
        in_ros2 = self._in_ros2(self._subscribed(asked.topic))
        self._graph.receive(rooted(asked.topic), asked.msg if in_ros2 else from_ros1(asked.msg))

    def _subscribe(self, asked: _Operation) -> None:
        """Subscribe to a topic. The options of the newest subscription count; all results wait to be sent."""
        topic = rooted(asked.topic)
        if topic not in self._graph.published:
            raise BadMessage(f"no publisher of {topic}: expected one of {', '.join(self._graph.published)}")
        published = self._graph.published[topic]
        _check_type(topic, published.kind, asked.type)
        self._notice(asked.type)
        length = LONGEST_FEED if topic == COMMAND_RESULT else asked.queue_length or 1
        self._outbox.set_feed(topic, 1e-3 * (asked.throttle_rate or 0.0), length)
        self._subscriptions.setdefault(topic, set()).add(asked.id)

        def frame(content: Message) -> str:
            message = content if self._in_ros2(published) else to_ros1(content)
            return _encoded({"op": "publish", "topic": asked.topic, "msg": message})

        def send(content: Message) -> None:  # in the tick: the frame is made when it is sent
            self._outbox.feed(topic, lambda: frame(content))

        if topic not in self._ends:
            self._ends[topic] = self._graph.listen(topic, send)

    def _unsubscribe(self, asked: _Operation) -> None:
        topic = rooted(asked.topic)
        if topic not in self._subscriptions:
            raise BadMessage(f"{topic} is not subscribed to")
        self._subscriptions[topic].discard(asked.id)
        if asked.id is None or not self._subscriptions[topic]:
            del self._subscriptions[topic]
            self._ends.pop(topic)()
            self._outbox.end_feed(topic)

    # Services

    def _call_service(self, asked: _Operation) -> None:
        self._notice(asked.type)
        try:
            values, result = self._answer(rooted(asked.service), asked.args or {}), True
        except BadMessage as fault:
            values, result = str(fault), False
            self._log.refused(self._name, _shown(asked.service), COMMUNICATION_FAILURE, values)
        response = {"op": "service_response", "service": asked.service, "values": values, "result": result}
        self._reply(asked, response)

    def _answer(self, name: str, arguments: Any) -> Any:
        """Return the response of a service. Raises BadMessage."""
        if name == CANCEL_SERVICE:
            self._joints.cancel()
            return {"return_code": 0, "goals_canceling": []}
        service = self._graph.services.get(name)
        if service is None:
            argument = str(next(iter(arguments.values()), "")) if isinstance(arguments, dict) else ""
            self._notice(argument)
            self._speaks_ros2 |= name == ROS_VERSION
            return rosapi(self._graph, name, argument, self._speaks_ros2)
        if self._in_ros2(service):
            return self._graph.call(name, arguments)
        return to_ros1(self._graph.call(name, from_ros1(arguments)))

    # Goals

    def _send_goal(self, asked: _Operation) -> None:
        """Follow a trajectory; its end, or the reason for its rejection, is an `action_result`."""
        self._speaks_ros2 = True
        identifier, feed = str(asked.id), f"feedback {asked.id}"

        def result(status: int, values: Any, *, ran: bool = True) -> None:
            self._goals.pop(identifier, None)
            self._outbox.end_feed(feed)  # clients take feedback behind the result for a fault
            message = {"op": "action_result", "action": asked.action, "values": values, "status": status}
            self._reply(asked, {**message, "result": ran})

        def feedback(values: Message) -> None:
            message = {"op": "action_feedback", "action": asked.action, "values": values, "id": asked.id}
            self._outbox.feed(feed, lambda: _encoded(message))

        try:
            if rooted(asked.action) != ACTION:
                raise BadMessage(f"there is no action {_shown(asked.action)}: expected {ACTION}")
            _check_type(ACTION, ACTION_TYPE, asked.action_type)
            number = self._joints.send_goal(asked.args or {}, result, feedback if asked.feedback else None)
        except BadMessage as fault:
            self._log.refused(self._name, ACTION, COMMUNICATION_FAILURE, str(fault))
            result(_UNKNOWN, f"Action goal was rejected: {fault}", ran=False)
            return
        self._goals[identifier] = number
        self._outbox.set_feed(feed, 0.0, 1)

    def _cancel_goal(self, asked: _Operation) -> None:
        number = self._goals.get(str(asked.id))
        if number is None:
            raise BadMessage("there is no such goal, or it has ended")
        self._joints.cancel(number)


def _encoded(message: Message) -> str:
    return msgspec.json.encode(message).decode()


def _check_type(name: str, kind: str, given: Any) -> None:
    if given not in (None, "", "*") and short_name(str(given)) != short_name(kind):
        raise BadMessage(f"{name} is of type {short_name(kind)}, not {_shown(given)}")


def _shown(what: object) -> str:
    text = what.decode("utf-8", "backslashreplace") if isinstance(what, bytes) else str(what)
    return shortened(harmless(text), 200)
