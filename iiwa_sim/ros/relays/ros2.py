"""The node of ROS 2: it relays topics, services and the action of iiwa-sim by rclpy."""

import array
import importlib
import sys
import threading
import traceback
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from itertools import count
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

CLOCK = "/clock"  # not under the namespace: all robots of a graph have one time
EMPTY = "structure_needs_at_least_one_member"
"""A field that rclpy shows of messages without any."""
BARRIER = "/rosapi/nodes"
"""A service whose response shows that what was sent before was taken."""
THREADS = 10
"""One for messages, one for goal requests, four for services and four for the ends of goals."""
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""action_msgs/GoalStatus."""
INVALID_GOAL = -1
POLL_S = 0.01
"""Period at which a goal looks whether its client wants to cancel it."""


def serve(pipe: Pipe, config: Message) -> None:
    """Be a node until standard input ends. Raises Fault."""
    try:
        # Signals are for the parent process, which closes standard input.
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        node = rclpy.create_node(config["node"], namespace=config["namespace"] or None)
    except (RuntimeError, ValueError, NameValidationException) as fault:
        raise Fault(f"ROS 2: no node: {fault}") from None
    relay = Relay(pipe, node, config)
    executor = rclpy.executors.MultiThreadedExecutor(num_threads=THREADS)
    executor.add_node(node)

    def spin() -> None:
        while True:
            try:
                executor.spin()
                return
            except rclpy.executors.ExternalShutdownException:
                return
            except Exception:  # noqa: BLE001  # a callback failed, as after a client has disconnected
                traceback.print_exc()

    pipe.say("ready", node=node.get_fully_qualified_name())
    for topic, kind, recurs, _ in config["publish"]:
        if not recurs and topic in relay.publishers:
            pipe.say("subscribe", topic=topic, type=kind)
    spinning = threading.Thread(target=spin, name="spin")
    spinning.start()
    try:
        pipe.read(relay.take)
    finally:
        for goal in list(relay.goals.values()):
            goal.ended.set()  # the robot has gone, and a thread that waits would keep the executor
        executor.shutdown(timeout_sec=0.0)
        spinning.join(10.0)
        node.destroy_node()
        rclpy.try_shutdown()


@dataclass
class _Goal:
    """A requested goal."""

    number: str
    handle: Any = None
    """The goal as rclpy has it, once it is accepted."""
    ended: threading.Event = field(default_factory=threading.Event)
    end: Message = field(default_factory=dict)


class Relay:
    """Topics, services and the action of the node."""

    def __init__(self, pipe: Pipe, node: Any, config: Message) -> None:
        self._pipe = pipe
        self._node = node
        self.publishers: dict[str, tuple[Any, Any]] = {}
        self.goals: dict[str, _Goal] = {}  # whose end has not been reported
        self._requested: Any = None  # the last requested goal: rclpy accepts one after the other
        self._numbers = count(1)
        # Messages and goals one at a time and in their order; services at the same time.
        messages, goals = MutuallyExclusiveCallbackGroup(), MutuallyExclusiveCallbackGroup()
        together = ReentrantCallbackGroup()
        for made, own, (topic, kind, recurs, latched) in self._typed(config["publish"]):
            qos: Any = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL) if latched else 10
            events = PublisherEventCallbacks(matched=partial(self._matched, topic, kind)) if recurs else None
            self.publishers[topic] = made, node.create_publisher(made, own, qos, event_callbacks=events)
        for made, own, (topic, _) in self._typed(config["subscribe"]):
            node.create_subscription(made, own, partial(self._publish, topic), 10, callback_group=messages)
        for made, own, (service, _) in self._typed(config["serve"]):
            node.create_service(made, own, partial(self._serve, service), callback_group=together)
        for made, own, action in self._typed(config["actions"]):
            self._action, self._made = action, made
            self._server = rclpy.action.ActionServer(
                node,
                made,
                own,
                self._execute,
                callback_group=goals,
                goal_callback=self._request,
                handle_accepted_callback=self._accepted,
                cancel_callback=lambda _: rclpy.action.CancelResponse.ACCEPT,
            )

    def take(self, message: Message) -> None:
        """Take a message of iiwa-sim: of a topic to publish, or news of a goal."""
        if message["op"] == "publish":
            made, publisher = self.publishers[message["topic"]]
            publisher.publish(fill(made(), message["msg"]))
        elif message["op"].startswith("action_") and (goal := self.goals.get(message["id"])) is not None:
            if message["op"] == "action_result":
                goal.end = message
                goal.ended.set()
            elif goal.handle is not None and not goal.ended.is_set():
                goal.handle.publish_feedback(fill(self._made.Feedback(), message["values"]))

    def _typed(self, rows: list[list[Any]]) -> Iterator[tuple[Any, str, list[Any]]]:
        """Yield class, name under the node's namespace, and row of each that has a type."""
        for row in rows:
            made = class_of(row[1])
            if made is None:
                self._node.get_logger().warning(f"{row[0]} is left out: {sys.executable} lacks {row[1]}")
            else:
                yield made, row[0] if row[0] == CLOCK else row[0].lstrip("/"), row

    def _matched(self, topic: str, kind: str, now: Any) -> None:
        """Subscribe to a topic while it has subscribers: a robot at rest without any does not tick."""
        self._pipe.say("subscribe" if now.current_count else "unsubscribe", topic=topic, type=kind)

    def _publish(self, topic: str, message: Any) -> None:
        self._pipe.say("publish", topic=topic, msg=plain(message))

    def _serve(self, service: str, request: Any, response: Any) -> Any:
        values, fault = self._pipe.call(service, plain(request))
        if not fault:
            return fill(response, values)
        # ROS 2 has no answer for a call that fails, and an exception in a service ends rclpy.
        self._node.get_logger().warning(f"{service}: {fault}")
        return fill(response, {"message": fault}) if hasattr(response, "message") else response

    def _request(self, request: Any) -> Any:
        """Ask for a goal. It was rejected if its end has come before the response to a later call."""
        number = f"goal {next(self._numbers)}"
        goal = self.goals[number] = _Goal(number)
        asked = {"action": self._action[0], "action_type": self._action[1], "id": number, "feedback": True}
        self._pipe.say("send_action_goal", args=plain(request), **asked)
        self._pipe.call(BARRIER, {})
        if goal.end.get("result", True):
            self._requested = goal
            return rclpy.action.GoalResponse.ACCEPT
        del self.goals[number]
        return rclpy.action.GoalResponse.REJECT

    def _accepted(self, handle: Any) -> None:
        self._requested.handle, handle.goal = handle, self._requested
        handle.execute()

    def _execute(self, handle: Any) -> Any:
        """Wait for the end and report it. A thread waits for each goal; older goals have just ended."""
        goal, cancelling = handle.goal, False
        while not goal.ended.wait(POLL_S):
            if handle.is_cancel_requested and not cancelling:
                cancelling = True
                self._pipe.say("cancel_action_goal", id=goal.number)
        status, result = goal.end.get("status", ABORTED), goal.end.get("values", {"error_code": INVALID_GOAL})
        if status == CANCELED and not cancelling:  # by another client: rclpy allows it to none
            status, result = ABORTED, {**result, "error_code": INVALID_GOAL}
        {SUCCEEDED: handle.succeed, CANCELED: handle.canceled}.get(status, handle.abort)()
        del self.goals[goal.number]
        return fill(self._made.Result(), result)


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
    """Put values into a message and return it; raises for values that do not fit."""
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
    if isinstance(value, array.array):
        return [shortest(each) for each in value] if value.typecode == "f" else value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    return value
