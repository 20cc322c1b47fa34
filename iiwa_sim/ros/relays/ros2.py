"""The node of ROS 2: it relays topics, services and the action of iiwa-sim by rclpy."""

import array
import importlib
import os
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import rclpy
import rclpy.action
import rclpy.executors
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.exceptions import NameValidationException
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.type_support import check_for_type_support
from rosidl_generator_py.import_type_support_impl import UnsupportedTypeSupport

from .pipe import Fault, Pipe, shortest

Message = dict[str, Any]

ABSOLUTE = ("/clock",)
"""Names that are not put under the namespace: all robots of a graph have one time."""
EMPTY = "structure_needs_at_least_one_member"
"""A field that rclpy shows of messages without any."""
BARRIER = "/rosapi/nodes"
"""A service whose response shows that what was sent before was taken."""
CALLS_AT_ONCE, GOALS_AT_ONCE = 4, 4
"""Threads for services, and for the ends of goals; all but the newest goal have ended already."""
END_S = 10.0
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""action_msgs/GoalStatus."""
INVALID_GOAL = -1
GONE = {
    "status": ABORTED,
    "values": {"error_code": INVALID_GOAL, "error_string": "the robot has gone"},
    "result": True,
}
"""The end of a goal that has none else."""
BETWEEN_S = 0.001
CANCELING_S = 10.0
"""rclpy takes less to note that a goal is to be cancelled, before which it cannot be."""


def serve(pipe: Pipe, config: Message) -> None:
    """Be a node until standard input ends. Raises Fault."""
    try:
        # Signals are for who has started this process: it closes standard input.
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        node = rclpy.create_node(config["node"], namespace=config["namespace"] or None)
    except (RuntimeError, ValueError, NameValidationException) as fault:
        raise Fault(f"ROS 2: no node: {fault}") from None
    relay = Relay(pipe, node)
    relay.join(config)
    threads = 2 + CALLS_AT_ONCE + GOALS_AT_ONCE  # two: messages, and goals that are asked for
    executor = rclpy.executors.MultiThreadedExecutor(num_threads=threads)
    executor.add_node(node)

    def spin() -> None:
        try:
            executor.spin()
        except rclpy.executors.ExternalShutdownException:
            pass
        except Exception:  # noqa: BLE001  # whatever it is, the node hears nothing from now on
            traceback.print_exc()
            os._exit(1)  # iiwa-sim starts another

    pipe.say("ready", without=relay.without, node=node.get_fully_qualified_name())
    for operation, topic, kind in relay.first:
        pipe.say(operation, topic=topic, type=kind)
    spinning = threading.Thread(target=spin, name="spin")
    spinning.start()
    try:
        pipe.read(relay.take)
    finally:
        relay.close()
        executor.shutdown(timeout_sec=0.0)
        spinning.join(END_S)
        node.destroy_node()
        rclpy.try_shutdown()


class Relay:
    """What the node has on the graph of ROS 2."""

    def __init__(self, pipe: Pipe, node: Any) -> None:
        self._pipe = pipe
        self._node = node
        self._publishers: dict[str, tuple[Any, Any]] = {}
        self._goals: Goals | None = None
        self.first: list[tuple[str, str, str]] = []
        """What to say once the node is there, with topic and type: what is sent, and what is always heard."""
        self.without: list[str] = []
        """Names of what has no type in this interpreter."""

    def join(self, config: Message) -> None:
        """Make all that the first line asks for."""
        node = self._node
        for topic, kind, recurs, latched in config["publish"]:
            if (found := self._typed(topic, kind)) is None:
                continue
            qos: Any = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL) if latched else 10
            events = PublisherEventCallbacks(matched=self._matched(topic, kind)) if recurs else None
            publisher = node.create_publisher(found, _relative(topic), qos, event_callbacks=events)
            self._publishers[topic] = (found, publisher)
            if not recurs:
                self.first.append(("subscribe", topic, kind))
        # Messages one at a time and in their order; services at the same time as they.
        alone, together = MutuallyExclusiveCallbackGroup(), ReentrantCallbackGroup()
        for topic, kind in config["subscribe"]:
            if (found := self._typed(topic, kind)) is not None:
                own, hear = _relative(topic), self._hears(topic)
                node.create_subscription(found, own, hear, 10, callback_group=alone)
                self.first.append(("advertise", topic, kind))
        for service, kind in config["serve"]:
            if (found := self._typed(service, kind)) is not None:
                node.create_service(found, _relative(service), self._serves(service), callback_group=together)
        for action, kind in config["actions"]:
            if (found := self._typed(action, kind)) is not None:
                self._goals = Goals(self._pipe, node, action, kind, found)

    def take(self, message: Message) -> None:
        """Take a message of iiwa-sim: of a topic to publish, or news of a goal."""
        if message["op"] == "publish":
            kind, publisher = self._publishers[message["topic"]]
            publisher.publish(fill(kind(), message["msg"]))
        elif self._goals is not None and message["op"].startswith("action_"):
            self._goals.take(message)

    def close(self) -> None:
        """End what waits for the robot: a thread that still waited would keep the process."""
        if self._goals is not None:
            self._goals.close()

    def _typed(self, name: str, kind: str) -> Any:
        found = class_of(kind)
        if found is None:
            self.without.append(name)
        return found

    def _matched(self, topic: str, kind: str) -> Callable[[Any], None]:
        """Hear a topic as long as somebody subscribes: a robot at rest that nobody watches does not tick."""

        def matched(now: Any) -> None:
            if now.current_count:
                self._pipe.say("subscribe", topic=topic, type=kind)
            else:
                self._pipe.say("unsubscribe", topic=topic)

        return matched

    def _hears(self, topic: str) -> Callable[[Any], None]:
        def hear(message: Any) -> None:
            self._pipe.say("publish", topic=topic, msg=plain(message))

        return hear

    def _serves(self, service: str) -> Callable[[Any, Any], Any]:
        def serve(request: Any, response: Any) -> Any:
            values, fault = self._pipe.call(service, plain(request))
            if not fault:
                return fill(response, values)
            # ROS 2 has no answer for a call that fails, and rclpy ends with what a service raises.
            self._node.get_logger().warning(f"{service}: {fault}")
            return fill(response, {"message": fault}) if hasattr(response, "message") else response

        return serve


@dataclass
class _Goal:
    """A goal that was asked for."""

    number: str
    handle: Any = None
    ended: threading.Event = field(default_factory=threading.Event)
    end: Message = field(default_factory=lambda: GONE)
    cancelling: bool = False


class Goals:
    """The goals of one action."""

    def __init__(self, pipe: Pipe, node: Any, name: str, kind: str, made: Any) -> None:
        """`made` is the class of the action."""
        self._pipe = pipe
        self._name, self._kind, self._made = name, kind, made
        self._count = 0
        self._goals: dict[str, _Goal] = {}  # not told to have ended
        self._wished: dict[int, _Goal] = {}  # by the id of the request, which rclpy passes on as it is
        self._server = rclpy.action.ActionServer(
            node,
            made,
            _relative(name),
            self._execute,
            # One at a time and in their order. What follows a goal is not of this group.
            callback_group=MutuallyExclusiveCallbackGroup(),
            goal_callback=self._wish,
            handle_accepted_callback=self._accepted,
            cancel_callback=self._cancel,
        )

    def take(self, message: Message) -> None:
        """Take news of a goal: feedback, or its end."""
        goal = self._goals.get(message["id"])
        if goal is None:
            return
        if message["op"] == "action_result":
            goal.end = message
            goal.ended.set()
        elif goal.handle is not None and not goal.ended.is_set():
            goal.handle.publish_feedback(fill(self._made.Feedback(), message["values"]))

    def close(self) -> None:
        """End all goals: their robot is gone."""
        for goal in list(self._goals.values()):
            goal.ended.set()

    def _wish(self, request: Any) -> Any:
        """Ask for a goal. It was rejected if its end has come before the response to a later call."""
        self._count += 1
        number = f"goal {self._count}"
        goal = self._goals[number] = _Goal(number)
        asked = {"action": self._name, "action_type": self._kind, "id": number, "feedback": True}
        sent = self._pipe.say("send_action_goal", args=plain(request), **asked)
        values, _ = self._pipe.call(BARRIER, {}) if sent else (None, "")
        if values is not None and goal.end["result"]:
            self._wished[id(request)] = goal
            return rclpy.action.GoalResponse.ACCEPT
        del self._goals[number]
        if sent and not goal.ended.is_set():  # late, it would be followed for nobody
            self._pipe.say("cancel_action_goal", action=self._name, id=number)
        return rclpy.action.GoalResponse.REJECT

    def _accepted(self, handle: Any) -> None:
        handle.goal = goal = self._wished.pop(id(handle.request))
        goal.handle = handle
        handle.execute()

    def _execute(self, handle: Any) -> Any:
        """Wait for the end, and tell it. A thread waits for each goal, of which the older have just ended."""
        goal = handle.goal
        goal.ended.wait()
        status, result = goal.end["status"], goal.end["values"]
        if status == CANCELED:
            end_s = time.monotonic() + CANCELING_S
            while goal.cancelling and not handle.is_cancel_requested and time.monotonic() < end_s:
                time.sleep(BETWEEN_S)
            if not handle.is_cancel_requested:  # nobody may be told of a cancelling who has not asked for it
                status, result = ABORTED, {**result, "error_code": INVALID_GOAL}
        tell = {SUCCEEDED: handle.succeed, CANCELED: handle.canceled}.get(status, handle.abort)
        tell()
        del self._goals[goal.number]
        return fill(self._made.Result(), result)

    def _cancel(self, handle: Any) -> Any:
        if not handle.goal.ended.is_set():
            handle.goal.cancelling = True
            self._pipe.say("cancel_action_goal", action=self._name, id=handle.goal.number)
        return rclpy.action.CancelResponse.ACCEPT


def _relative(name: str) -> str:
    """Return the name as the node knows it, which its namespace is put in front of."""
    return name if name in ABSOLUTE else name.lstrip("/")


def class_of(name: str) -> Any:
    """Return the class of package/msg/Type and so on; None if it is not installed, or does not fit."""
    package, kind, own = name.split("/")
    try:
        found = getattr(importlib.import_module(f"{package}.{kind}"), own)
        check_for_type_support(found)
    except (ImportError, AttributeError, UnsupportedTypeSupport):
        return None
    return found


def fill(message: Any, values: Message) -> Any:
    """Put values into a message and return it; raises for what does not fit."""
    types = dict(zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True))
    for name, value in values.items():
        kind = types[name]
        if isinstance(value, dict):
            fill(getattr(message, name), value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            element = kind.value_type
            made = getattr(importlib.import_module(".".join(element.namespaces)), element.name)
            setattr(message, name, [fill(made(), each) for each in value])
        elif getattr(kind, "typename", "") == "octet":
            setattr(message, name, bytes([value]))
        else:
            setattr(message, name, value)
    return message


def plain(value: Any) -> Any:
    """Return a message as dicts, lists and numbers."""
    if hasattr(value, "get_fields_and_field_types"):
        return {
            name: shortest(getattr(value, name)) if kind == "float" else plain(getattr(value, name))
            for name, kind in value.get_fields_and_field_types().items()
            if name != EMPTY
        }
    if isinstance(value, bytes):
        return list(value)
    if isinstance(value, array.array) and value.typecode == "f":
        return [shortest(each) for each in value]
    if isinstance(value, array.array) or hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    return value
