"""One client of rosbridge: the operations of protocol v2, JSON in and JSON or CBOR out, no sockets.

The protocol: https://github.com/RobotWebTools/rosbridge_suite, ROSBRIDGE_PROTOCOL.md. An operation that is
not allowed or not possible is answered by a `status` of level `error` that echoes its `id`, and changes
nothing. A client that goes does not stop the robot: it is one of many publishers, as everywhere in ROS.

A client that names a type as ROS 2 does, package/msg/Type, or sends a goal, is told everything in the form of
ROS 2 from then on. Topics that ROS 1 does not have are always in that form.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from hashlib import sha512
from hmac import compare_digest
from typing import Any, NamedTuple

import msgspec

from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, Refused
from iiwa_sim.log import SessionLog
from iiwa_sim.ros.appendix_a import COMMAND_RESULT
from iiwa_sim.ros.graph import Graph, Served
from iiwa_sim.ros.joint_interface import ACTION, ACTION_TYPE, GoalEnd, JointInterface
from iiwa_sim.ros.messages import BadMessage, Message, from_ros1, interface, serialized, short_name, to_ros1
from iiwa_sim.ros.outbox import LONGEST_FEED, Frame, Outbox
from iiwa_sim.ros.rosapi import ACTION_SERVERS, ROS_VERSION, RosApi, rooted
from iiwa_sim.wording import harmless, shortened

LEVELS = ("none", "error", "warning", "info")
"""Levels of status messages, of which a client chooses one. We send errors only."""
COMPRESSIONS = ("none", "cbor", "cbor-raw")
"""JSON; CBOR; CBOR around the bytes of ROS 1. Of several subscriptions to a topic the last in this order
counts, as in rosbridge_suite."""
CANCEL_SERVICE = f"{ACTION}/_action/cancel_goal"
"""How roslibjs cancels all goals of an action."""
CLOCKS_APART_S = 5
"""Greatest difference between the time in an `auth` and the time here."""
_UNKNOWN = 0  # of action_msgs/GoalStatus

_encode = msgspec.json.Encoder().encode
_decoder = msgspec.json.Decoder(dict[str, Any])


class Misuse(Exception):
    """An operation is refused. The message is for the client."""


class _Wish(NamedTuple):
    """The options of one subscription."""

    throttle_s: float
    queue_length: int
    compression: str


@dataclass
class _Subscription:
    """A topic to which the client is subscribed, once or several times."""

    name: str
    """The name as the client writes it, by which it tells topics apart."""
    in_ros2: bool
    wishes: dict[Any, _Wish]
    """Options by the ids of the subscriptions."""
    end: Callable[[], None] = lambda: None

    @property
    def compression(self) -> str:
        """The most demanding one of the subscriptions."""
        return max((each.compression for each in self.wishes.values()), key=COMPRESSIONS.index)


class RosbridgeSession:
    """One client's messages in, and replies and topics out through its outbox."""

    def __init__(
        self,
        graph: Graph,
        joints: JointInterface,
        outbox: Outbox,
        log: SessionLog,
        name: str,
        *,
        secret: str | None = None,
        now_s: Callable[[], float] = time.time,
    ) -> None:
        """The client has to authenticate first, by `auth`, where there is a secret.

        `now_s` returns the time since 1970 that an `auth` is compared with.
        """
        self.closing = False
        """True if the client has failed to authenticate: it is closed once it has been told."""
        self._graph, self._joints, self._api = graph, joints, RosApi(graph)
        self._outbox = outbox
        self._log, self._name = log, name
        self._secret, self._now_s = secret, now_s
        self._level = LEVELS.index("error")
        self._known = secret is None
        self._speaks_ros2 = False
        self._subscriptions: dict[str, _Subscription] = {}
        self._goals: dict[str, int] = {}  # numbers by the client's ids
        self._feedback = ""  # the feed of the newest goal's
        self._operations: dict[str, Callable[[Message], None]] = {
            "advertise": self._advertise,
            "unadvertise": lambda _: None,
            "publish": self._publish,
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
            "call_service": self._call_service,
            "send_action_goal": self._send_goal,
            "cancel_action_goal": self._cancel_goal,
            "auth": self._authenticate,
            "set_level": self._set_level,
            "status": lambda _: None,
        }

    def receive(self, text: bytes) -> None:
        """Handle one message of the client."""
        try:
            message = _decoder.decode(text)
        except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as fault:
            self._refuse(text, None, f"expected one JSON object: {fault}")
        else:
            self.handle(message, text)

    def handle(self, message: Message, text: object) -> None:
        """Handle a message that was decoded from a text, which is for the log."""
        identifier, operation = message.get("id"), message.get("op")
        try:
            if not self._known and operation != "auth":
                self.closing = True
                raise Misuse("expected op auth before any other")
            if not isinstance(operation, str) or operation not in self._operations:
                raise Misuse(f"op {_shown(operation)}: expected {', '.join(self._operations)}")
            self._operations[operation](message)
        except (Misuse, BadMessage) as fault:
            self._refuse(text, identifier, str(fault))
        except Exception as fault:  # noqa: BLE001  # an internal error must not cost the client its connection
            self._log.exception(self._name, _shown(text), fault)
            self._tell(identifier, "internal error, see the log")

    def end(self) -> None:
        """Notice that the client has gone. Its goal goes on, as everywhere in ROS."""
        for topic in list(self._subscriptions):
            self._end_feed(topic)
        for number in self._goals.values():
            self._joints.forget(number)

    def _refuse(self, text: object, identifier: Any, reason: str) -> None:
        self._log.refused(self._name, _shown(text), COMMUNICATION_FAILURE, reason)
        self._tell(identifier, reason)

    def _tell(self, identifier: Any, reason: str) -> None:
        if self._level:
            self._reply({"op": "status", "level": "error", "msg": reason}, identifier)

    def _reply(self, message: Message, identifier: Any) -> None:
        told = message if identifier is None else {**message, "id": identifier}
        self._outbox.reply(_encode(told).decode())

    def _notice(self, kind: Any) -> None:
        """Notice the name of a type: the client may speak ROS 2."""
        self._speaks_ros2 |= isinstance(kind, str) and kind.count("/") == 2

    # Topics

    def _advertise(self, message: Message) -> None:
        topic, kind = _topic_of(message), message.get("type")
        self._notice(kind)
        _check_type(topic, self._heard(topic).kind, kind)

    def _heard(self, topic: str) -> Served:
        """A topic that the robot subscribes to."""
        if topic not in self._graph.subscribed:
            raise Misuse(f"nobody listens to {topic}: expected {', '.join(self._graph.subscribed)}")
        return self._graph.subscribed[topic]

    def _publish(self, message: Message) -> None:
        topic, content = _topic_of(message), message.get("msg", {})
        known_to_ros1 = self._heard(topic).in_ros1
        in_ros2 = self._speaks_ros2 or not known_to_ros1
        self._graph.receive(topic, content if in_ros2 else from_ros1(content))

    def _subscribe(self, message: Message) -> None:
        topic, kind = _topic_of(message), message.get("type")
        if topic not in self._graph.published:
            raise Misuse(f"nobody publishes {topic}: expected one of {', '.join(self._graph.published)}")
        published = self._graph.published[topic]
        _check_type(topic, published.kind, kind)
        self._notice(kind)
        in_ros2 = self._speaks_ros2 or not published.in_ros1
        wish = _Wish(
            throttle_s=1e-3 * _number_of(message, "throttle_rate"),
            queue_length=int(_number_of(message, "queue_length")),
            compression=_compression_of(message, COMPRESSIONS[:2] if in_ros2 else COMPRESSIONS),
        )
        subscription = self._subscriptions.get(topic)
        if subscription is not None and subscription.in_ros2 == in_ros2:
            subscription.wishes[_key_of(message)] = wish
            self._set_feed(topic)
            return
        if subscription is not None:
            self._end_feed(topic)
        subscription = _Subscription(message["topic"], in_ros2, {_key_of(message): wish})
        self._subscriptions[topic] = subscription
        self._set_feed(topic)

        def hear(content: Message, seq: int) -> None:  # in the tick: the frame is made when it is sent
            self._outbox.feed(topic, partial(self._frame, topic, subscription, content, seq))

        subscription.end = self._graph.listen(topic, hear)

    def _unsubscribe(self, message: Message) -> None:
        topic = _topic_of(message)
        if topic not in self._subscriptions:
            raise Misuse(f"{topic} is not subscribed to")
        wishes = self._subscriptions[topic].wishes
        if "id" in message:
            wishes.pop(_key_of(message), None)
        if "id" not in message or not wishes:
            self._end_feed(topic)
        else:
            self._set_feed(topic)

    def _set_feed(self, topic: str) -> None:
        """Combine several subscriptions: the most demanding options count. All results wait to be sent."""
        wishes = self._subscriptions[topic].wishes.values()
        length = LONGEST_FEED if topic == COMMAND_RESULT else max(each.queue_length for each in wishes)
        self._outbox.set_feed(topic, min(each.throttle_s for each in wishes), length)

    def _end_feed(self, topic: str) -> None:
        self._subscriptions.pop(topic).end()
        self._outbox.end_feed(topic)

    def _frame(self, topic: str, subscription: _Subscription, content: Message, seq: int) -> Frame:
        told = content if subscription.in_ros2 else to_ros1(content, seq)
        compression = subscription.compression
        if compression == "cbor-raw":
            (definition,) = interface(self._graph.published[topic].kind, "msg", ros2=False)
            told = {**to_ros1(self._graph.stamp), "bytes": serialized(definition, told)}
        frame = {"op": "publish", "topic": subscription.name, "msg": told}
        return _encode(frame).decode() if compression == "none" else frame

    # Services

    def _call_service(self, message: Message) -> None:
        name = message.get("service")
        if not isinstance(name, str):
            raise Misuse("service: expected a name")
        self._notice(message.get("type"))
        try:
            values, result = self._answer(rooted(name), message.get("args", {})), True
        except (Misuse, BadMessage, KeyError) as fault:
            values = f"there is no {_shown(fault.args[0])}" if isinstance(fault, KeyError) else str(fault)
            result = False
            self._log.refused(self._name, f"call_service {_shown(name)}", COMMUNICATION_FAILURE, values)
        response = {"op": "service_response", "service": name, "values": values, "result": result}
        self._reply(response, message.get("id"))

    def _answer(self, name: str, arguments: Any) -> Any:
        """The response of a service. Raises Misuse, BadMessage and KeyError."""
        if name == CANCEL_SERVICE:
            self._joints.cancel()
            return {"return_code": 0, "goals_canceling": []}
        service = self._graph.services.get(name)
        if service is not None:
            fields = interface(service.kind, "srv")[0].fields
            request = _request_of([field.name for field in fields], arguments)
            in_ros2 = self._speaks_ros2 or not service.in_ros1
            response = self._graph.call(name, request if in_ros2 else from_ros1(request))
            return response if in_ros2 else to_ros1(response)
        _, names, answer = self._api.services[name]
        request = _request_of(names, arguments)
        request = request if isinstance(request, dict) else {}
        self._notice(request.get("type"))
        self._speaks_ros2 |= name == ROS_VERSION
        return answer(request, self._speaks_ros2 or name == ACTION_SERVERS)

    # Goals

    def _send_goal(self, message: Message) -> None:
        """Follow a trajectory; everything that is told of it, also a refusal, is an `action_result`."""
        self._speaks_ros2 = True
        action, identifier = message.get("action"), message.get("id")
        feed = f"feedback {identifier}"

        def result(values: Any, status: int, *, ran: bool) -> None:
            told = {"op": "action_result", "action": action, "values": values, "status": status}
            self._reply({**told, "result": ran}, identifier)

        def ended(end: GoalEnd) -> None:
            self._goals.pop(str(identifier), None)
            self._outbox.end_feed(feed)  # clients take feedback behind the result for a fault
            result(end.result, end.status, ran=True)

        def hear(values: Message) -> None:
            told = {"op": "action_feedback", "action": action, "values": values, "id": identifier}
            self._outbox.feed(feed, lambda: _encode(told).decode())

        wanted = bool(message.get("feedback", False))
        try:
            if not isinstance(action, str) or rooted(action) != ACTION:
                raise Misuse(f"there is no action {_shown(action)}: expected {ACTION}")
            _check_type(ACTION, ACTION_TYPE, message.get("action_type"))
            if str(identifier) in self._goals:
                raise Misuse("expected an id of its own")
            number = self._joints.send_goal(
                message.get("args", {}), ended, hear if wanted else None, self._name
            )
        except (Misuse, BadMessage, Refused) as fault:
            reason = fault.reason if isinstance(fault, Refused) else str(fault)
            self._log.refused(self._name, ACTION, COMMUNICATION_FAILURE, reason)
            result(f"Action goal was rejected: {reason}", _UNKNOWN, ran=False)
            return
        self._goals[str(identifier)] = number
        if wanted:
            self._outbox.end_feed(self._feedback)
            self._feedback = feed
            self._outbox.set_feed(feed, 0.0, 1)

    def _cancel_goal(self, message: Message) -> None:
        number = self._goals.get(str(message.get("id")))
        if number is None:
            raise Misuse("there is no such goal, or it has ended")
        self._joints.cancel(number)

    # The client itself

    def _authenticate(self, message: Message) -> None:
        if self._secret is None or self._known:
            return
        wrong = fault_of(message, self._secret, int(self._now_s()))
        if wrong is not None:
            self.closing = True
            raise Misuse(f"not let in: {wrong}")
        self._known = True

    def _set_level(self, message: Message) -> None:
        level = message.get("level")
        if level not in LEVELS:
            raise Misuse(f"level {_shown(level)}: expected one of {', '.join(LEVELS)}")
        self._level = LEVELS.index(level)


def fault_of(auth: Message, secret: str, now_s: int) -> str | None:
    """Return the fault in the fields of an `auth`; None if they are right.

    The code is that of rosauth (https://wiki.ros.org/rosauth): SHA-512 over the secret, client, dest, rand,
    t, level and end; `t` must be near the present time (s since 1970), and `end` in the future.
    """
    for name in ("client", "dest", "rand", "level", "mac"):
        if not isinstance(auth.get(name), str):
            return f"{name}: expected text"
    for name in ("t", "end"):
        if not isinstance(auth.get(name), int) or isinstance(auth[name], bool):
            return f"{name}: expected whole seconds since 1970"
    if abs(now_s - auth["t"]) > CLOCKS_APART_S:
        return f"t is more than {CLOCKS_APART_S} s from the time here"
    if auth["end"] < now_s:
        return "end is over"
    fields = (str(auth[name]) for name in ("client", "dest", "rand", "t", "level", "end"))
    expected = sha512("".join([secret, *fields]).encode("utf-8", "backslashreplace")).hexdigest()
    if not compare_digest(expected.encode(), auth["mac"].encode("utf-8", "backslashreplace")):
        return "mac: made with another secret, or of other fields"
    return None


def _topic_of(message: Message) -> str:
    """The topic that an operation is about, from the root on."""
    topic = message.get("topic")
    if not isinstance(topic, str):
        raise Misuse("topic: expected a name")
    return rooted(topic)


def _check_type(name: str, kind: str, told: Any) -> None:
    if told not in (None, "", "*") and short_name(str(told)) != short_name(kind):
        raise Misuse(f"{name} is of type {short_name(kind)}, not {_shown(told)}")


def _number_of(message: Message, field: str) -> float:
    value = message.get(field)
    if value is None:
        return 0.0
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= 2**31:
        raise Misuse(f"{field}: expected a number from 0 on")
    return float(value)


def _compression_of(message: Message, offered: Sequence[str]) -> str:
    wanted = message.get("compression")
    if wanted is None:
        return offered[0]
    if wanted not in offered:
        raise Misuse(f"compression {_shown(wanted)}: expected {', '.join(offered)}")
    return str(wanted)


def _key_of(message: Message) -> Any:
    """The id by which a subscription of a topic is known."""
    identifier = message.get("id")
    return identifier if isinstance(identifier, str | int | float) else None


def _request_of(names: Sequence[str], arguments: Any) -> Any:
    """The request as a message: arguments by name, or in the order of the fields."""
    if not isinstance(arguments, list):
        return {} if arguments is None else arguments
    if len(arguments) > len(names):
        raise BadMessage(f"expected up to {len(names)} arguments, got {len(arguments)}")
    return dict(zip(names, arguments, strict=False))


def _shown(what: object) -> str:
    text = what.decode("utf-8", "backslashreplace") if isinstance(what, bytes) else str(what)
    return shortened(harmless(text), 200)
