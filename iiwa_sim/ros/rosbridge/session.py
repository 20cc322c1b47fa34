"""One client of rosbridge: the operations of protocol v2, JSON in and JSON out, no sockets.

The protocol: https://github.com/RobotWebTools/rosbridge_suite, ROSBRIDGE_PROTOCOL.md. An operation that is
not allowed or not possible is answered by a `status` of level `error` that echoes its `id`, and changes
nothing. A client that goes does not stop the robot: it is one of many publishers, as everywhere in ROS.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, NoReturn

import msgspec

from iiwa_sim.controller.errors import COMMUNICATION_FAILURE
from iiwa_sim.dialect.wire.log import DialectLog
from iiwa_sim.ros.arm.joint_level import SERVICES as OF_ARM
from iiwa_sim.ros.arm.joint_level import JointLevel
from iiwa_sim.ros.arm.messages import BadGoal, in_ros2, ros1_name
from iiwa_sim.ros.rmi.definitions import Definition, service
from iiwa_sim.ros.rmi.node import COMMAND_RESULT, PUBLISHED, SUBSCRIBED, BadMessage, Message, Node
from iiwa_sim.ros.rosbridge import ros2
from iiwa_sim.ros.rosbridge.encodings import COMPRESSIONS, encoded_once
from iiwa_sim.ros.rosbridge.mac import Secret
from iiwa_sim.ros.rosbridge.outbox import LONGEST_FEED, Outbox
from iiwa_sim.ros.rosbridge.ros2 import CANCEL_SERVICE, Ros2Client, is_ros2
from iiwa_sim.ros.rosbridge.rosapi import RosApi, rooted
from iiwa_sim.ros.rosbridge.rosapi_ros2 import ACTION_SERVERS, ONLY_HERE
from iiwa_sim.wording import harmless, shortened

LEVELS = ("none", "error", "warning", "info")
"""Levels of status messages; a client chooses one and gets only messages up to it. We send errors only."""
NOT_OURS = (
    "advertise_service",
    "unadvertise_service",
    "service_response",
    "advertise_action",
    "unadvertise_action",
    "fragment",
)
"""Operations of the protocol that are not supported here; they are refused by name."""

MOST_SUBSCRIPTIONS = 1000
"""Subscriptions of one client to one topic, which are told apart by their ids."""
LONGEST_ID = 200
"""Letters of a subscription's id."""

_encode = msgspec.json.Encoder().encode
_decoder = msgspec.json.Decoder(dict[str, Any])
_LONGEST_SHOWN = 200


class _Misuse(Exception):
    """An operation is refused. The message is for the client."""


class _Wish(NamedTuple):
    """The options of one subscription."""

    throttle_s: float
    queue_length: int
    compression: str


@dataclass
class _Subscribed:
    """A topic with the subscriptions of the client."""

    hear: Callable[[Message], None]
    wishes: dict[Any, _Wish]
    """Options by the ids of the subscriptions."""
    compression: str = COMPRESSIONS[0]
    """The most demanding compression of the subscriptions."""


class RosbridgeSession:
    """One client's messages in, and replies and topics out through its outbox."""

    def __init__(
        self,
        node: Node,
        api: RosApi,
        outbox: Outbox,
        log: DialectLog,
        name: str,
        *,
        secret: Secret | None = None,
        arm: JointLevel | None = None,
    ) -> None:
        """With a secret, the client has to authenticate first, by `auth`; with an `arm` it has ROS 2's
        topics."""
        self.closing = False
        """Whether the client has failed to authenticate: it is closed once it has been told."""
        self._node = node
        self._api = api
        self._outbox = outbox
        self._log = log
        self._name = name
        self._secret = secret
        self._level = LEVELS.index("error")
        self._known = secret is None
        self._subscribed: dict[str, _Subscribed] = {}
        self._arm = arm
        self._ros2 = Ros2Client(node, arm, outbox, self._reply, name)
        self._speaks_ros2 = False  # it has named a type as ROS 2 does, or an action
        self._operations: dict[str, Callable[[Message], None]] = {
            "advertise": self._advertise,
            "unadvertise": self._unadvertise,
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
        identifier: Any = None
        log = self._log
        try:
            try:
                message = _decoder.decode(text)
            except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as fault:
                raise _Misuse(f"expected one JSON object: {fault}") from None
            identifier = message.get("id")
            operation = message.get("op")
            if not self._known and operation != "auth":
                self.closing = True
                raise _Misuse("expected op auth before any other")
            if not isinstance(operation, str) or operation not in self._operations:
                known = ", ".join(self._operations)
                what = f"op {_shown(operation)}"
                raise _Misuse(
                    f"{what} is not offered here" if operation in NOT_OURS else f"{what}: expected {known}"
                )
            self._operations[operation](message)
        except (_Misuse, BadMessage) as fault:
            self._refuse(text, identifier, str(fault))
        except Exception as fault:  # an internal error must not cost the client its connection
            log.exception(self._name, _shown(text), fault)
            self._tell(identifier, "internal fault, told in the log")

    def end(self) -> None:
        """Notice that the client has gone."""
        for topic in list(self._subscribed):
            self._end_feed(topic)
        self._ros2.end()

    def _refuse(self, text: bytes, identifier: Any, reason: str) -> None:
        self._log.refused(self._name, _shown(text), COMMUNICATION_FAILURE, reason)
        self._tell(identifier, reason)

    def _tell(self, identifier: Any, reason: str) -> None:
        if self._level:
            status = {"op": "status", "level": "error", "msg": reason}
            self._reply(status if identifier is None else {**status, "id": identifier})

    def _reply(self, message: Message) -> None:
        self._outbox.reply(_encode(message).decode())

    def _advertise(self, message: Message) -> None:
        topic, kind = self._topic_of(message), message.get("type")
        self._speaks_ros2 = self._speaks_ros2 or is_ros2(kind)
        _check_type(topic, self._listened(topic), kind)

    def _listened(self, topic: str) -> str:
        """The type of a topic that the robot listens to."""
        kind = SUBSCRIBED.get(topic) or self._ros2.takes(topic)
        if kind is None:
            raise _Misuse(f"nobody listens to {topic}: expected {', '.join(SUBSCRIBED)}")
        return kind

    def _unadvertise(self, message: Message) -> None:
        self._topic_of(message)

    def _publish(self, message: Message) -> None:
        topic = self._topic_of(message)
        self._listened(topic)
        if self._speaks_ros2 or topic not in SUBSCRIBED:
            self._ros2.publish(topic, message.get("msg", {}))
        else:
            self._node.receive(topic, message.get("msg", {}))

    def _subscribe(self, message: Message) -> None:
        topic = self._topic_of(message)
        known = self._ros2.type_of(topic)
        if known is None:
            raise _Misuse(f"nobody publishes {topic}: expected one of {', '.join(PUBLISHED)}")
        kind_told = message.get("type")
        _check_type(topic, known, kind_told)
        self._speaks_ros2 = self._speaks_ros2 or is_ros2(kind_told)
        if self._speaks_ros2 or topic not in PUBLISHED:
            _check_whole(message)
            throttle_s = 1e-3 * _number(message, "throttle_rate")
            length = LONGEST_FEED if topic == COMMAND_RESULT else int(_number(message, "queue_length"))
            compression = _compression(message, ros2.COMPRESSIONS)
            self._ros2.subscribe(topic, message["topic"], throttle_s, length, compression)
            return
        wish = _Wish(
            throttle_s=1e-3 * _number(message, "throttle_rate"),
            queue_length=int(_number(message, "queue_length")),
            compression=_compression(message, COMPRESSIONS),
        )
        _check_whole(message)
        key = _key(message)
        if topic not in self._subscribed:
            name = message["topic"]  # the name as the client writes it, by which it tells topics apart
            kind, wishes = PUBLISHED[topic][0], dict[Any, _Wish]()

            now = self._node.time

            def hear(content: Message) -> None:  # runs in the tick for each client, so it has to be cheap
                self._outbox.feed(
                    topic, partial(encoded_once, subscribed.compression, name, kind, content, now)
                )

            self._subscribed[topic] = subscribed = _Subscribed(hear, wishes)
            self._node.listen(topic, hear)
        wishes = self._subscribed[topic].wishes
        if key not in wishes and len(wishes) >= MOST_SUBSCRIPTIONS:
            raise _Misuse(f"{topic} is subscribed to {MOST_SUBSCRIPTIONS} times: expected no more")
        wishes[key] = wish
        self._set_feed(topic)

    def _unsubscribe(self, message: Message) -> None:
        topic = self._topic_of(message)
        if self._ros2.hears(topic):
            self._ros2.unsubscribe(topic)
            return
        if topic not in self._subscribed:
            raise _Misuse(f"{topic} is not subscribed to")
        wishes = self._subscribed[topic].wishes
        if "id" in message:
            wishes.pop(_key(message), None)
        else:
            wishes.clear()
        if wishes:
            self._set_feed(topic)
        else:
            self._end_feed(topic)

    def _set_feed(self, topic: str) -> None:
        """Combine several subscriptions: the most demanding options count. Results wait until they are
        sent."""
        wishes = self._subscribed[topic].wishes.values()
        self._subscribed[topic].compression = max(
            (each.compression for each in wishes), key=COMPRESSIONS.index
        )
        queue_length = LONGEST_FEED if topic == COMMAND_RESULT else max(each.queue_length for each in wishes)
        self._outbox.set_feed(topic, min(each.throttle_s for each in wishes), queue_length)

    def _end_feed(self, topic: str) -> None:
        self._node.unlisten(topic, self._subscribed.pop(topic).hear)
        self._outbox.end_feed(topic)

    def _call_service(self, message: Message) -> None:
        name = message.get("service")
        if not isinstance(name, str):
            raise _Misuse("service: expected a name")

        def respond(values: Any, *, result: bool = True) -> None:
            response = {"op": "service_response", "service": name, "values": values, "result": result}
            self._reply({**response, "id": message["id"]} if "id" in message else response)

        def fail(reason: str) -> None:
            self._log.refused(self._name, f"call_service {_shown(name)}", COMMUNICATION_FAILURE, reason)
            respond(reason, result=False)

        service_name, arguments = rooted(name), message.get("args", {})
        self._speaks_ros2 = self._speaks_ros2 or is_ros2(message.get("type")) or service_name in ONLY_HERE
        try:
            _compression(message, ("none",))
            _check_whole(message)
            if self._arm is not None and service_name in (*OF_ARM, CANCEL_SERVICE):
                respond(self._call_arm(self._arm, service_name, arguments))
                return
            if service_name in self._node.services:
                fields = service(self._node.services[service_name]).request.fields
                request = _request([field.name for field in fields], arguments)
                answer = respond
                if self._speaks_ros2:
                    definition = service(self._node.services[service_name]).response
                    answer = partial(_respond_in_ros2, respond, definition)
                self._node.call(service_name, request, answer, fail)
                return
            values = self._call_rosapi(service_name, arguments)
        except (_Misuse, BadMessage, BadGoal) as fault:
            fail(str(fault))
        except KeyError as missing:
            fail(f"there is no {_shown(missing.args[0])}")
        else:
            respond(values)

    def _call_rosapi(self, name: str, arguments: Any) -> Any:
        names, _ = self._api.calls.get(name) or self._ros2.api.calls[name]
        request = _request(names, arguments)
        request = request if isinstance(request, dict) else {}
        self._speaks_ros2 = self._speaks_ros2 or is_ros2(request.get("type"))
        in_ros2 = self._speaks_ros2 or name == ACTION_SERVERS  # a robot has no actions of ROS 1
        _, call = (self._ros2.api.calls if in_ros2 else self._api.calls)[name]
        return call(request)

    @staticmethod
    def _call_arm(arm: JointLevel, name: str, arguments: Any) -> Any:
        if name == CANCEL_SERVICE:
            arm.cancel()
            return {"return_code": 0, "goals_canceling": []}
        return arm.call(name, _request(["data"], arguments))

    def _send_goal(self, message: Message) -> None:
        self._speaks_ros2 = True
        self._ros2.send_goal(message)

    def _cancel_goal(self, message: Message) -> None:
        wrong = self._ros2.cancel_goal(message)
        if wrong is not None:
            raise _Misuse(wrong)

    def _authenticate(self, message: Message) -> None:
        if self._secret is None or self._known:
            return
        wrong = self._secret.fault_of(message)
        if wrong is not None:
            self.closing = True
            raise _Misuse(f"not let in: {wrong}")
        self._known = True

    def _set_level(self, message: Message) -> None:
        if message.get("level") not in LEVELS:
            raise _Misuse(f"level {_shown(message.get('level'))}: expected one of {', '.join(LEVELS)}")
        self._level = LEVELS.index(message["level"])

    def _topic_of(self, message: Message) -> str:
        topic = message.get("topic")
        if not isinstance(topic, str):
            raise _Misuse("topic: expected a name")
        return rooted(topic)


def _check_type(topic: str, kind: str, told: Any) -> None:
    if told not in (None, "", "*", kind) and ros1_name(str(told)) != ros1_name(kind):
        raise _Misuse(f"{topic} is of type {kind}, not {_shown(told)}")


def _respond_in_ros2(respond: Callable[[Any], None], definition: Definition, values: Message) -> None:
    respond(in_ros2(definition, values))


def _number(message: Message, field: str) -> float:
    value = message.get(field, 0)
    if value is None:
        return 0.0
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= 2**31:
        _expected_number(field)
    return float(value)


def _expected_number(field: str) -> NoReturn:
    raise _Misuse(f"{field}: expected a number from 0 on")


def _compression(message: Message, offered: tuple[str, ...]) -> str:
    wanted = message.get("compression")
    if wanted is None:
        return offered[0]
    if wanted not in offered:
        raise _Misuse(f"compression {_shown(wanted)}: expected {', '.join(offered)}")
    return str(wanted)


def _check_whole(message: Message) -> None:
    if message.get("fragment_size") is not None:
        raise _Misuse("fragment_size: expected none, messages are sent whole")


def _key(message: Message) -> Any:
    """The id by which a subscription of a topic is known."""
    identifier = message.get("id")
    if isinstance(identifier, str) and len(identifier) > LONGEST_ID:
        raise _Misuse(f"id: expected up to {LONGEST_ID} letters, got {len(identifier)}")
    return identifier if isinstance(identifier, str | int | float) else None


def _request(names: Sequence[str], arguments: Any) -> Any:
    """The request as a message: arguments by name, or in the order of the fields."""
    if not isinstance(arguments, list):
        return {} if arguments is None else arguments
    if len(arguments) > len(names):
        raise BadMessage(f"expected up to {len(names)} arguments, got {len(arguments)}")
    return dict(zip(names, arguments, strict=False))


def _shown(what: Any) -> str:
    text = what.decode("utf-8", "backslashreplace") if isinstance(what, bytes) else str(what)
    return shortened(harmless(text), _LONGEST_SHOWN)
