"""The node of ROS 2, told by lines what to do.

It knows nothing of robots: standard input tells it line by line, as JSON, what to publish, and on standard
output it tells what it has heard. It ends when standard input does. The lines that come in, the first of
which says what there shall be:

- {"node": ..., "namespace": ..., "publish": [[topic, type, latched]], "subscribe": [[topic, type]],
  "serve": [[service, type]], "actions": [[action, type]]}
- {"topic": ..., "msg": {...}}, to be published
- {"answer": number, "response": {...}}, of a call; {"answer": number, "failed": "..."}
- {"goal": number, "accepted": bool}
- {"feedback": number, "values": {...}} and {"end": number, "status": ..., "result": {...}}, of a goal

The lines that go out, the first of which is one of the first two:

- {"ready": [names]}, of what has no type here
- {"fault": "..."}, in one line; the process ends then
- {"topic": ..., "msg": {...}}, heard
- {"subscribers": number, "to": topic}, of one that is published
- {"call": number, "service": ..., "request": {...}}
- {"goal": number, "action": ..., "request": {...}} and {"cancel": number}, of a goal

What is too long to be told has {"long": bytes} in place of "msg" or "request".
"""

import contextlib
import importlib
import json
import os
import sys
import threading
import traceback
from collections.abc import Callable
from typing import Any

from .calls import ANSWER_S, Calls
from .goals import Goals
from .messages import class_of, fill, plain
from .out import Out

CALLS_AT_ONCE = 4
END_S = 10.0
GOALS_AT_ONCE = 4
"""Threads that wait for the ends of goals; all but the newest goal have ended already."""


class Ros:
    """The parts of rclpy that are used; raises ImportError where one is missing."""

    def __init__(self) -> None:
        self.rclpy = importlib.import_module("rclpy")
        self.action = importlib.import_module("rclpy.action")
        self.groups = importlib.import_module("rclpy.callback_groups")
        self.events = importlib.import_module("rclpy.event_handler")
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
    graph = Graph(ros, node, out)
    without = graph.join(told)
    threads = 2 + CALLS_AT_ONCE + GOALS_AT_ONCE  # two: messages, and goals that are asked for
    executor = ros.executors.MultiThreadedExecutor(num_threads=threads)
    executor.add_node(node)

    def spin() -> None:
        try:
            executor.spin()
        except ros.executors.ExternalShutdownException:
            pass
        except Exception:  # noqa: BLE001 (whatever it is, the node hears nothing from now on)
            traceback.print_exc()
            os._exit(1)  # iiwa-sim starts another

    spinning = threading.Thread(target=spin, name="spin")
    spinning.start()
    out.tell(ready=without)
    try:
        for line in sys.stdin:
            graph.take(json.loads(line))
    finally:
        graph.close()
        executor.shutdown(timeout_sec=0.0)
        spinning.join(END_S)
        node.destroy_node()
        ros.rclpy.try_shutdown()


class Graph:
    """What the node has on the graph of ROS 2."""

    def __init__(self, ros: Ros, node: Any, out: Out) -> None:
        self._ros = ros
        self._node = node
        self._out = out
        self._calls = Calls(out, "call")
        self._goals: Goals | None = None
        self._publishers: dict[str, Any] = {}
        self._without: list[str] = []

    def join(self, told: dict[str, Any]) -> list[str]:
        """Make all that the first line asks for; gives the names of what has no type here."""
        node, qos, groups = self._node, self._ros.qos, self._ros.groups
        latched = qos.QoSProfile(depth=1, durability=qos.DurabilityPolicy.TRANSIENT_LOCAL)
        for topic, kind, kept in told["publish"]:
            if (found := self._typed(topic, kind)) is not None:
                heeded = self._ros.events.PublisherEventCallbacks(matched=self._matched(topic))
                publisher = node.create_publisher(
                    found, topic, latched if kept else 10, event_callbacks=heeded
                )
                self._publishers[topic] = (found, publisher)
        # Messages one at a time and in their order; services at the same time as they.
        alone, together = groups.MutuallyExclusiveCallbackGroup(), groups.ReentrantCallbackGroup()
        for topic, kind in told["subscribe"]:
            if (found := self._typed(topic, kind)) is not None:
                node.create_subscription(found, topic, self._hears(topic), 10, callback_group=alone)
        for service, kind in told["serve"]:
            if (found := self._typed(service, kind)) is not None:
                node.create_service(found, service, self._serves(service), callback_group=together)
        for action, kind in told["actions"]:
            if (found := self._typed(action, kind)) is not None:
                self._goals = Goals(self._ros, node, action, found, self._out)
        return self._without

    def take(self, said: dict[str, Any]) -> None:
        """Carry out a line of iiwa-sim: a message to publish, the answer to a call, or news of a goal."""
        if "topic" in said:
            if said["topic"] in self._publishers:
                kind, publisher = self._publishers[said["topic"]]
                publisher.publish(fill(kind(), said["msg"]))
        elif "answer" in said:
            self._calls.answered(said["answer"], said)
        elif self._goals is not None:
            self._goals.told(said)

    def close(self) -> None:
        """End what waits for the robot: a thread that still waited would keep the process."""
        self._calls.close()
        if self._goals is not None:
            self._goals.close()

    def _typed(self, name: str, kind: str) -> Any:
        found = class_of(kind)
        if found is None:
            self._without.append(name)
        return found

    def _matched(self, topic: str) -> Callable[[Any], None]:
        """Tell how many there are now, whenever a subscriber comes or goes."""
        return lambda now: self._out.tell(subscribers=now.current_count, to=topic)

    def _hears(self, topic: str) -> Callable[[Any], None]:
        return lambda message: self._out.tell(topic=topic, msg=plain(message))

    def _serves(self, service: str) -> Callable[[Any, Any], Any]:
        def serve(request: Any, response: Any) -> Any:
            _, said = self._calls.ask(service=service, request=plain(request))
            if said is None:
                said = {"failed": f"not answered in {ANSWER_S:g} s"}
            if "failed" not in said:
                return fill(response, said["response"])
            # ROS 2 has no answer for a call that fails, and rclpy ends with what a service raises.
            self._node.get_logger().warning(f"{service}: {said['failed']}")
            return fill(response, {"message": said["failed"]}) if hasattr(response, "message") else response

        return serve


def run() -> None:
    """Be a node until standard input ends."""
    with contextlib.suppress(BrokenPipeError, KeyboardInterrupt):
        main()
    os._exit(0)  # a thread of the executor that has not ended would keep the process
