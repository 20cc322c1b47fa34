"""A robot on ROS 2, driven with rclpy: joint states, a trajectory, a service.

iiwa-sim ros2-env
iiwa-sim --ros2 --ros-namespace cell
~/.cache/iiwa-sim/ros2/bin/python examples/ros2_rclpy.py cell
"""

import os
import sys
import time

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")  # as iiwa-sim has it

import rclpy
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

NAMESPACE = sys.argv[1]
PATIENCE_S = 50.0
AWAY = [0.2, 0.7, 0.2, -0.9, 0.2, 1.2, 0.2]

rclpy.init()
node = rclpy.create_node("user", namespace=NAMESPACE)
states = []
node.create_subscription(JointState, "joint_states", states.append, 100)
trajectories = node.create_publisher(JointTrajectory, "joint_trajectory_controller/joint_trajectory", 10)


def wait_until(holds):
    end_s = time.monotonic() + PATIENCE_S
    while not holds():
        if time.monotonic() > end_s:
            sys.exit("the robot is not there, or does not go")
        rclpy.spin_once(node, timeout_sec=0.1)


def there(position):
    return max(abs(a - b) for a, b in zip(states[-1].position, position, strict=True)) < 1e-6


def send(*points):
    trajectories.publish(JointTrajectory(joint_names=states[-1].name, points=points))


def point(position, seconds):
    message = JointTrajectoryPoint(positions=position)
    message.time_from_start.sec = seconds
    return message


wait_until(lambda: states and trajectories.get_subscription_count())
print("joints", *states[-1].name, flush=True)
send(point(AWAY, 3))
wait_until(lambda: there(AWAY))
print("there", flush=True)

stop = node.create_client(Trigger, "stop")
wait_until(stop.service_is_ready)
future = stop.call_async(Trigger.Request())
wait_until(future.done)
print("stop", future.result().success, flush=True)
node.destroy_node()
rclpy.shutdown()
