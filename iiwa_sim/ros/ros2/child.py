"""The node of ROS 2, run by an interpreter that has rclpy and nothing of iiwa-sim.

It knows nothing of robots: standard input tells it line by line, as JSON, what to publish, and on standard
output it tells what it has heard. It ends when standard input does. The lines that come in, the first of
which says what there shall be:

- {"node": ..., "namespace": ..., "publish": [[topic, type, latched]], "subscribe": [[topic, type]],
  "serve": [[service, type]]}
- {"topic": ..., "msg": {...}}, to be published
- {"answer": number, "response": {...}}, of a call

The lines that go out, the first of which is one of the first two:

- {"ready": [names]}, of what has no type here
- {"fault": "..."}, in one line; the process ends then
- {"topic": ..., "msg": {...}}, heard
- {"topic": ..., "long": bytes}, heard and too long to be told
- {"call": number, "service": ..., "request": {...}}
"""

import array
import contextlib
import importlib
import json
import os
import sys
import threading
from collections.abc import Callable
from typing import Any

ANSWER_S = 10.0
"""A service whose answer takes longer fails."""
CALLS_AT_ONCE = 4
LONGEST_BYTES = 1 << 20
"""A trajectory of 2,000 points with all they can have fits."""


class Out:
    """Standard output, for several threads; what libraries print goes to standard error."""

    def __init__(self) -> None:
        self._stream = os.fdopen(os.dup(1), "w", encoding="utf-8")
        os.dup2(2, 1)
        self._lock = threading.Lock()

    def tell(self, **what: Any) -> None:
        text = json.dumps(what)
        if len(text) > LONGEST_BYTES:
            text = json.dumps({"topic": what.get("topic", ""), "long": len(text)})
        with self._lock:
            self._stream.write(text + "\n")
            self._stream.flush()


def class_of(name: str) -> Any:
    """The class of package/msg/Type or package/srv/Type; None where it is not installed."""
    package, kind, own = name.split("/")
    try:
        return getattr(importlib.import_module(f"{package}.{kind}"), own)
    except (ImportError, AttributeError):
        return None


def fill(message: Any, told: dict[str, Any]) -> Any:
    """Put a dict into a message; raises for what does not fit."""
    types = dict(zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True))
    for name, value in told.items():
        kind = types[name]
        if isinstance(value, dict):
            fill(getattr(message, name), value)
        elif isinstance(value, list) and value and isinstance(value[0], dict):
            element = kind.value_type
            cls = getattr(importlib.import_module(".".join(element.namespaces)), element.name)
            setattr(message, name, [fill(cls(), each) for each in value])
        elif getattr(kind, "typename", "") == "octet":
            setattr(message, name, bytes([value]))
        else:
            setattr(message, name, value)
    return message


def plain(value: Any) -> Any:
    """A message as dicts, lists and numbers."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, bytes):
        return list(value)
    if isinstance(value, array.array) or hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    return value


class Calls:
    """Services: each call waits here for its answer."""

    def __init__(self, out: Out) -> None:
        self._out = out
        self._lock = threading.Lock()
        self._next = 0
        self._waiting: dict[int, Any] = {}

    def ask(self, service: str, request: Any) -> Any:
        """The response as a dict; None where none came in time."""
        there = threading.Event()
        with self._lock:
            self._next += 1
            number = self._next
            self._waiting[number] = [there, None]
        self._out.tell(call=number, service=service, request=plain(request))
        there.wait(ANSWER_S)
        with self._lock:
            return self._waiting.pop(number)[1]

    def answered(self, number: int, response: Any) -> None:
        with self._lock:
            waiting = self._waiting.get(number)
            if waiting is not None:
                waiting[1] = response
                waiting[0].set()


class Ros:
    """What of rclpy is used; raises ImportError where it is not there, or not whole."""

    def __init__(self) -> None:
        self.rclpy = importlib.import_module("rclpy")
        self.groups = importlib.import_module("rclpy.callback_groups")
        self.executors = importlib.import_module("rclpy.executors")
        self.qos = importlib.import_module("rclpy.qos")
        self.no_handlers = importlib.import_module("rclpy.signals").SignalHandlerOptions.NO
        exceptions = importlib.import_module("rclpy.exceptions")
        self.faults = (RuntimeError, ValueError, exceptions.NameValidationException)


def main() -> None:
    out = Out()
    told = json.loads(sys.stdin.readline() or "null")
    if told is None:
        return
    try:
        ros = Ros()
    except ImportError as fault:
        hint = "iiwa-sim ros2-env makes an environment that has it"
        out.tell(fault=f"{sys.executable} has no rclpy that works ({fault}): {hint}")
        return
    try:
        # Signals are for who has started this process: it closes standard input.
        ros.rclpy.init(signal_handler_options=ros.no_handlers)
        node = ros.rclpy.create_node(told["node"], namespace=told["namespace"] or None)
    except ros.faults as fault:
        out.tell(fault=f"no node: {' '.join(str(fault).split())[:300]}")
        return
    calls = Calls(out)
    publishers, without = joined(ros, node, told, out, calls)
    executor = ros.executors.MultiThreadedExecutor(num_threads=1 + CALLS_AT_ONCE)
    executor.add_node(node)

    def spin() -> None:
        with contextlib.suppress(ros.executors.ExternalShutdownException):
            executor.spin()

    spinning = threading.Thread(target=spin, name="spin")
    spinning.start()
    out.tell(ready=without)
    try:
        for line in sys.stdin:
            said = json.loads(line)
            if "answer" in said:
                calls.answered(said["answer"], said["response"])
            elif said["topic"] in publishers:
                kind, publisher = publishers[said["topic"]]
                publisher.publish(fill(kind(), said["msg"]))
    finally:
        executor.shutdown(timeout_sec=0.0)
        spinning.join(ANSWER_S)
        node.destroy_node()
        ros.rclpy.try_shutdown()


def joined(
    ros: Ros, node: Any, told: dict[str, Any], out: Out, calls: Calls
) -> tuple[dict[str, Any], list[str]]:
    """Class and publisher of each topic, and the names of what has no type here; topics and services are
    made."""
    publishers: dict[str, Any] = {}
    without: list[str] = []
    latched = ros.qos.QoSProfile(depth=1, durability=ros.qos.DurabilityPolicy.TRANSIENT_LOCAL)

    def typed(name: str, kind: str) -> Any:
        found = class_of(kind)
        if found is None:
            without.append(name)
        return found

    def hears(topic: str) -> Callable[[Any], None]:
        return lambda message: out.tell(topic=topic, msg=plain(message))

    def serves(service: str) -> Callable[[Any, Any], Any]:
        def serve(request: Any, response: Any) -> Any:
            answer = calls.ask(service, request)
            if answer is None:
                raise TimeoutError(f"{service} has not been answered in {ANSWER_S:g} s")
            return fill(response, answer)

        return serve

    for topic, kind, kept in told["publish"]:
        if (found := typed(topic, kind)) is not None:
            publishers[topic] = (found, node.create_publisher(found, topic, latched if kept else 10))
    # Messages one at a time and in their order; services at the same time as they.
    alone, together = ros.groups.MutuallyExclusiveCallbackGroup(), ros.groups.ReentrantCallbackGroup()
    for topic, kind in told["subscribe"]:
        if (found := typed(topic, kind)) is not None:
            node.create_subscription(found, topic, hears(topic), 10, callback_group=alone)
    for service, kind in told["serve"]:
        if (found := typed(service, kind)) is not None:
            node.create_service(found, service, serves(service), callback_group=together)
    return publishers, without


if __name__ == "__main__":
    try:
        main()
    except (BrokenPipeError, KeyboardInterrupt):
        os._exit(0)
