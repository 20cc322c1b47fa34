"""A user's node of ROS 2, run by an interpreter that has rclpy: does what lines ask for, and answers each.

A line is a JSON object; the answer is one, too, with "fault" where something went wrong. Arguments: the
folder of `relays`, and the namespace.
"""

import json
import os
import sys
import time
import traceback

import rclpy
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile

sys.path.append(sys.argv[1])
from relays.ros2 import class_of, fill, plain

PATIENCE_S = 50.0
"""Less than a test waits for the answer to a line, so that it is told what has not happened."""
AGAIN_S = 5.0
"""Fast DDS gives up the response to a client that the server has not discovered within 0.1 s, which happens
on a busy machine (ros2/rclpy#1181): who has got none by then asks again."""
DEPTH = 1000


class User:
    def __init__(self, namespace):
        rclpy.init()
        self.node = rclpy.create_node(f"user_{os.getpid()}", namespace=namespace or None)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.heard, self.publishers, self.clients, self.actions, self.goals = {}, {}, {}, {}, {}

    def until(self, holds):
        end_s = time.monotonic() + PATIENCE_S
        while not holds():
            if time.monotonic() > end_s:
                raise TimeoutError("it has not happened")
            self.executor.spin_once(timeout_sec=0.1)

    def of(self, future):
        self.until(future.done)
        return future.result()

    def answer(self, ask):
        """The response to what `ask()` sends, which gives a future."""
        futures, asked_s = [], -AGAIN_S

        def responded():
            nonlocal asked_s
            if time.monotonic() > asked_s + AGAIN_S:
                asked_s = time.monotonic()
                futures.append(ask())
            return any(each.done() for each in futures)

        self.until(responded)
        return next(each.result() for each in futures if each.done())

    def hear(self, topic, kind, latched=False):
        """Begin to hear a topic; answers when somebody publishes it."""
        qos = QoSProfile(depth=DEPTH)
        if latched:
            qos.durability = DurabilityPolicy.TRANSIENT_LOCAL
        heard = []
        hears = self.node.create_subscription(
            class_of(kind), topic, lambda each: heard.append(plain(each)), qos
        )
        self.heard[topic] = hears, heard
        self.until(lambda: self.node.count_publishers(topic))
        return {}

    def wait(self, topic, count):
        """The messages of a topic, when there are so many since the last time."""
        _, heard = self.heard[topic]
        self.until(lambda: len(heard) >= count)
        told, heard[:] = list(heard), []
        return {"messages": told}

    def forget(self, topic):
        """Hear it no more."""
        hears, _ = self.heard.pop(topic)
        self.node.destroy_subscription(hears)
        return {}

    def publish(self, topic, kind, messages):
        """Publish; answers when all are acknowledged, which DDS may do only after 3 s."""
        kind = class_of(kind)
        if topic not in self.publishers:
            self.publishers[topic] = self.node.create_publisher(kind, topic, DEPTH)
        publisher = self.publishers[topic]
        self.until(publisher.get_subscription_count)
        for each in messages:
            publisher.publish(fill(kind(), each))
        self.until(lambda: publisher.wait_for_all_acked(rclpy.duration.Duration(seconds=0.1)))
        return {}

    def call(self, service, kind, request):
        kind = class_of(kind)
        if service not in self.clients:
            self.clients[service] = self.node.create_client(kind, service)
        client = self.clients[service]
        self.until(client.service_is_ready)
        return {"response": plain(self.answer(lambda: client.call_async(fill(kind.Request(), request))))}

    def goal(self, name, action, kind, goal):
        """Send a goal; answers whether it was accepted."""
        kind = class_of(kind)
        if action not in self.actions:
            self.actions[action] = ActionClient(self.node, kind, action)
        client = self.actions[action]
        self.until(client.server_is_ready)
        told = []

        def hear(message):
            told.append(plain(message.feedback))

        handle = self.answer(lambda: client.send_goal_async(fill(kind.Goal(), goal), feedback_callback=hear))
        if handle.accepted:
            self.goals[name] = (handle, handle.get_result_async(), told)
        return {"accepted": handle.accepted}

    def feedback(self, name, count):
        """Wait for so many feedbacks of a goal."""
        _, result, told = self.goals[name]
        self.until(lambda: len(told) >= count or result.done())
        return {"feedback": list(told)}

    def result(self, name):
        """Status and result of a goal, when it has ended, and its feedback."""
        _, result, told = self.goals[name]
        got = self.of(result)
        return {"status": got.status, "result": plain(got.result), "feedback": list(told)}

    def cancel(self, name):
        handle, _, _ = self.goals[name]
        response = self.of(handle.cancel_goal_async())
        return {"code": response.return_code, "canceling": len(response.goals_canceling)}


def main():
    user = User(sys.argv[2])
    for line in sys.stdin:
        asked = json.loads(line)
        try:
            answer = getattr(user, asked.pop("do"))(**asked)
        except Exception:  # noqa: BLE001 (told to the test, whatever it is)
            answer = {"fault": traceback.format_exc()}
        sys.stdout.write(json.dumps(answer) + "\n")
        sys.stdout.flush()
    user.executor.shutdown()
    user.node.destroy_node()
    rclpy.try_shutdown()


main()
