"""A user's node of ROS 2, run by an interpreter that has rclpy: plays a scenario, and prints it as JSON.

Arguments: the folder of `relays`, the namespace, the name of the scenario.
"""

import json
import os
import sys
import time
from math import nan

import rclpy
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile

sys.path.append(sys.argv[1])
from relays.ros2 import class_of, fill, plain

PATIENCE_S = 50.0
AGAIN_S = 5.0
"""Time (s) after which a client without a response asks again.
Fast DDS drops the response to a client that the server has not discovered in 0.1 s (ros2/rclpy#1181)."""
DEPTH = 1000
RMI = "robot_movement_interface"
HERE = [0.0, 0.523599, 0.0, -1.047198, 0.0, 1.570796, 0.0]
AWAY = [0.2, 0.7, 0.2, -0.9, 0.2, 1.2, 0.2]
HOUR_S = 3600
"""Duration of a motion that no slow machine ends too early."""

rclpy.init()
node = rclpy.create_node(f"user_{os.getpid()}", namespace=sys.argv[2])
executor = SingleThreadedExecutor()
executor.add_node(node)


def say(what):
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


def until(holds):
    """Spin until something holds, and return it."""
    end_s = time.monotonic() + PATIENCE_S
    while not (found := holds()):
        if time.monotonic() > end_s:
            raise TimeoutError("it has not happened")
        executor.spin_once(timeout_sec=0.1)
    return found


def answer(ask):
    """Return the response to what `ask()` sends, which gives a future."""
    futures, asked_s = [], -AGAIN_S

    def responded():
        nonlocal asked_s
        if time.monotonic() > asked_s + AGAIN_S:
            asked_s = time.monotonic()
            futures.append(ask())
        return [each for each in futures if each.done()]

    return until(responded)[0].result()


def subscribe(topic, kind, latched=False):
    """Return the list of a topic's messages, which grows once it is published."""
    qos = QoSProfile(depth=DEPTH)
    if latched:
        qos.durability = DurabilityPolicy.TRANSIENT_LOCAL
    messages = []
    node.create_subscription(class_of(kind), topic, lambda each: messages.append(plain(each)), qos)
    until(lambda: node.count_publishers(topic))
    return messages


def newest(topic, kind, latched=False):
    """Return a message of a topic."""
    messages = subscribe(topic, kind, latched)
    return until(lambda: messages)[-1]


def call(service, kind, **request):
    """Return the response of a service."""
    client = node.create_client(class_of(kind), service)
    until(client.service_is_ready)
    return plain(answer(lambda: client.call_async(fill(class_of(kind).Request(), request))))


class Goal:
    """A trajectory as a goal of the action, with its feedback."""

    KIND = class_of("control_msgs/action/FollowJointTrajectory")
    client = ActionClient(node, KIND, "joint_trajectory_controller/follow_joint_trajectory")

    def __init__(self, *points):
        """Take times in s and positions."""
        rows = [{"positions": place, "time_from_start": {"sec": time_s}} for time_s, place in points]
        trajectory = {"joint_names": [f"A{k}" for k in range(1, 8)], "points": rows}
        goal, self.feedback = fill(self.KIND.Goal(), {"trajectory": trajectory}), []
        until(self.client.server_is_ready)
        self.handle = answer(lambda: self.client.send_goal_async(goal, feedback_callback=self.subscribe))
        self.ended = self.handle.get_result_async()

    def subscribe(self, message):
        self.feedback.append(plain(message.feedback))

    def cancel(self):
        """Return how many goals are cancelled."""
        return len(answer(self.handle.cancel_goal_async).goals_canceling)

    def end(self):
        """Return status, error code and words."""
        until(self.ended.done)
        result = self.ended.result()
        return [result.status, result.result.error_code, result.result.error_string]


def commands():
    results = subscribe("command_result", f"{RMI}/msg/Result")
    kind, by_number = class_of(f"{RMI}/msg/CommandList"), {}
    publisher = node.create_publisher(kind, "command_list", DEPTH)
    until(publisher.get_subscription_count)
    for number, pose in enumerate((AWAY, [99.0] * 7, [nan] * 7), start=1):
        moves = {"command_type": "PTP", "pose_type": "JOINTS", "velocity_type": "%", "velocity": [0.5]}
        listed = [{"command_id": number, "pose": pose, **moves}]
        publisher.publish(fill(kind(), {"commands": listed, "replace_previous_commands": True}))
        by_number[number] = until(lambda: results and results.pop())
    set_io = call("set_io", f"{RMI}/srv/SetIO", number=2, value=True)
    states = call("robot/get_digital_ios", f"{RMI}/srv/GetDigitalIOs", ios=[])
    # A call that fails is answered, since ROS 2 has no error for it; the robot moves on.
    call("scale_speed", f"{RMI}/srv/SetFloat", value=nan)
    return {
        "results": [by_number[number] for number in sorted(by_number)],
        "status": newest("robot_status", "industrial_msgs/msg/RobotStatus"),
        "set_io": set_io,
        "on": [state["id"] for state in states["ios"] if state["value"]],
        "tf": newest("tf", "tf2_msgs/msg/TFMessage"),
        "tf_static": newest("tf_static", "tf2_msgs/msg/TFMessage", latched=True),
        "description": newest("robot_description", "std_msgs/msg/String", latched=True),
    }


def goals():
    reached = Goal((2, AWAY), (4, HERE))
    ends, feedback = [reached.end()], reached.feedback
    cancelled = Goal((HOUR_S, AWAY))
    until(lambda: cancelled.feedback)
    counts = [cancelled.cancel()]
    ends.append(cancelled.end())
    counts.append(cancelled.cancel())
    old, new = Goal((HOUR_S, AWAY)), Goal((HOUR_S, AWAY))
    ends.append(old.end())
    stopped = call("stop", "std_srvs/srv/Trigger")["success"]
    ends.append(new.end())
    return {"ends": ends, "feedback": feedback, "cancelled": counts, "stopped": stopped}


def cancelled_by_another():
    goal = Goal((HOUR_S, AWAY))
    say("sent")
    return goal.end()


say(globals()[sys.argv[3]]())
executor.shutdown()
node.destroy_node()
rclpy.try_shutdown()
