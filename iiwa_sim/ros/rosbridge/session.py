"""One client of rosbridge: the operations of protocol v2, JSON in and JSON out, no sockets.

The protocol: https://github.com/RobotWebTools/rosbridge_suite, ROSBRIDGE_PROTOCOL.md. An operation that is
not allowed or not possible is answered by a `status` of level `error` that echoes its `id`, and changes
nothing. A client that goes does not stop the robot: it is one of many publishers, as everywhere in ROS.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import msgspec

from iiwa_sim.controller.errors import COMMUNICATION_FAILURE
from iiwa_sim.protocols.session import ProtocolLog
from iiwa_sim.ros.arm.interfaces import interface
from iiwa_sim.ros.graph import Graph
from iiwa_sim.ros.rmi.message_text import BadMessage
from iiwa_sim.ros.rmi.node import COMMAND_RESULT, PUBLISHED, SUBSCRIBED, Message
from iiwa_sim.ros.rosbridge import ros2
from iiwa_sim.ros.rosbridge.fields import (
    Misuse,
    check_type,
    check_whole,
    compression_of,
    number_of,
    request_of,
    shown,
    topic_of,
)
from iiwa_sim.ros.rosbridge.introspection import rooted
from iiwa_sim.ros.rosbridge.mac import Secret
from iiwa_sim.ros.rosbridge.outbox import LONGEST_FEED, Outbox
from iiwa_sim.ros.rosbridge.ros2 import CANCEL_SERVICE, Ros2Client, is_ros2
from iiwa_sim.ros.rosbridge.rosapi import RosApi
from iiwa_sim.ros.rosbridge.rosapi_ros2 import ACTION_SERVERS, ONLY_HERE, Ros2Api
from iiwa_sim.ros.rosbridge.subscriptions import Subscriptions

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


_encode = msgspec.json.Encoder().encode
_decoder = msgspec.json.Decoder(dict[str, Any])


class RosbridgeSession:
    """One client's messages in, and replies and topics out through its outbox."""

    def __init__(
        self,
        graph: Graph,
        api: RosApi,
        outbox: Outbox,
        log: ProtocolLog,
        name: str,
        *,
        secret: Secret | None = None,
    ) -> None:
        """The client has to authenticate first, by `auth`, where there is a secret."""
        self.closing = False
        """Whether the client has failed to authenticate: it is closed once it has been told."""
        self._graph = graph
        self._node = node = graph.node
        self._api = api
        self._outbox = outbox
        self._log = log
        self._name = name
        self._secret = secret
        self._level = LEVELS.index("error")
        self._known = secret is None
        self._subscriptions = Subscriptions(node, outbox)
        self._ros2 = Ros2Client(graph, outbox, self._reply, name)
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
                raise Misuse(f"expected one JSON object: {fault}") from None
            identifier = message.get("id")
            operation = message.get("op")
            if not self._known and operation != "auth":
                self.closing = True
                raise Misuse("expected op auth before any other")
            if not isinstance(operation, str) or operation not in self._operations:
                known = ", ".join(self._operations)
                what = f"op {shown(operation)}"
                raise Misuse(
                    f"{what} is not offered here" if operation in NOT_OURS else f"{what}: expected {known}"
                )
            self._operations[operation](message)
        except (Misuse, BadMessage) as fault:
            self._refuse(text, identifier, str(fault))
        except Exception as fault:  # an internal error must not cost the client its connection
            log.exception(self._name, shown(text), fault)
            self._tell(identifier, "internal error, see the log")

    def end(self) -> None:
        """Notice that the client has gone."""
        self._subscriptions.end()
        self._ros2.end()

    def _refuse(self, text: bytes, identifier: Any, reason: str) -> None:
        self._log.refused(self._name, shown(text), COMMUNICATION_FAILURE, reason)
        self._tell(identifier, reason)

    def _tell(self, identifier: Any, reason: str) -> None:
        if self._level:
            status = {"op": "status", "level": "error", "msg": reason}
            self._reply(status if identifier is None else {**status, "id": identifier})

    def _reply(self, message: Message) -> None:
        self._outbox.reply(_encode(message).decode())

    def _advertise(self, message: Message) -> None:
        topic, kind = topic_of(message), message.get("type")
        self._speaks_ros2 = self._speaks_ros2 or is_ros2(kind)
        check_type(topic, self._listened(topic), kind)

    def _listened(self, topic: str) -> str:
        """The type of a topic that the robot listens to."""
        if topic not in self._graph.subscribed:
            raise Misuse(f"nobody listens to {topic}: expected {', '.join(SUBSCRIBED)}")
        return SUBSCRIBED.get(topic) or self._graph.subscribed[topic]

    def _unadvertise(self, message: Message) -> None:
        topic_of(message)

    def _publish(self, message: Message) -> None:
        topic = topic_of(message)
        self._listened(topic)
        if self._speaks_ros2 or topic not in SUBSCRIBED:
            self._graph.receive(topic, message.get("msg", {}), self._name)
        else:
            self._node.receive(topic, message.get("msg", {}))

    def _subscribe(self, message: Message) -> None:
        topic = topic_of(message)
        if topic not in self._graph.published:
            raise Misuse(f"nobody publishes {topic}: expected one of {', '.join(PUBLISHED)}")
        kind_told = message.get("type")
        check_type(topic, (PUBLISHED.get(topic) or self._graph.published[topic])[0], kind_told)
        self._speaks_ros2 = self._speaks_ros2 or is_ros2(kind_told)
        if self._speaks_ros2 or topic not in PUBLISHED:
            check_whole(message)
            throttle_s = 1e-3 * number_of(message, "throttle_rate")
            length = LONGEST_FEED if topic == COMMAND_RESULT else int(number_of(message, "queue_length"))
            compression = compression_of(message, ros2.COMPRESSIONS)
            self._ros2.subscribe(topic, message["topic"], throttle_s, length, compression)
            return
        self._subscriptions.add(topic, message)

    def _unsubscribe(self, message: Message) -> None:
        topic = topic_of(message)
        if self._ros2.hears(topic):
            self._ros2.unsubscribe(topic)
            return
        self._subscriptions.remove(topic, message)

    def _call_service(self, message: Message) -> None:
        name = message.get("service")
        if not isinstance(name, str):
            raise Misuse("service: expected a name")

        def respond(values: Any, *, result: bool = True) -> None:
            response = {"op": "service_response", "service": name, "values": values, "result": result}
            self._reply({**response, "id": message["id"]} if "id" in message else response)

        def fail(reason: str) -> None:
            self._log.refused(self._name, f"call_service {shown(name)}", COMMUNICATION_FAILURE, reason)
            respond(reason, result=False)

        service_name, arguments = rooted(name), message.get("args", {})
        self._speaks_ros2 = self._speaks_ros2 or is_ros2(message.get("type")) or service_name in ONLY_HERE
        try:
            compression_of(message, ("none",))
            check_whole(message)
            if service_name == CANCEL_SERVICE:
                self._graph.arm.cancel()
                respond({"return_code": 0, "goals_canceling": []})
                return
            kind = self._graph.services.get(service_name)
            if kind is not None:
                request = request_of([field.name for field in interface(kind)[0].fields], arguments)
                in_ros2 = self._speaks_ros2 or service_name not in self._node.services
                values: Any = (self._graph if in_ros2 else self._node).call(service_name, request)
            else:
                values = self._call_rosapi(service_name, arguments)
        except (Misuse, BadMessage) as fault:
            fail(str(fault))
        except KeyError as missing:
            fail(f"there is no {shown(missing.args[0])}")
        else:
            respond(values)

    def _call_rosapi(self, name: str, arguments: Any) -> Any:
        names, _ = self._api.calls.get(name) or self._ros2_api.calls[name]
        request = request_of(names, arguments)
        request = request if isinstance(request, dict) else {}
        self._speaks_ros2 = self._speaks_ros2 or is_ros2(request.get("type"))
        in_ros2 = self._speaks_ros2 or name == ACTION_SERVERS  # a robot has no actions of ROS 1
        _, call = (self._ros2_api.calls if in_ros2 else self._api.calls)[name]
        return call(request)

    @cached_property
    def _ros2_api(self) -> Ros2Api:
        """What there is, in the words of ROS 2."""
        return Ros2Api(self._graph)

    def _send_goal(self, message: Message) -> None:
        self._speaks_ros2 = True
        self._ros2.send_goal(message)

    def _cancel_goal(self, message: Message) -> None:
        wrong = self._ros2.cancel_goal(message)
        if wrong is not None:
            raise Misuse(wrong)

    def _authenticate(self, message: Message) -> None:
        if self._secret is None or self._known:
            return
        wrong = self._secret.fault_of(message)
        if wrong is not None:
            self.closing = True
            raise Misuse(f"not let in: {wrong}")
        self._known = True

    def _set_level(self, message: Message) -> None:
        if message.get("level") not in LEVELS:
            raise Misuse(f"level {shown(message.get('level'))}: expected one of {', '.join(LEVELS)}")
        self._level = LEVELS.index(message["level"])
