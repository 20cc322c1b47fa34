"""A joint trajectory as an action of ROS 2, sent with roslibpy over rosbridge: feedback, result, cancelling.

iiwa-sim --rosbridge-port 9090
python examples/ros2_roslibpy.py 127.0.0.1 9090
"""

import queue
import sys

import roslibpy

HOST, PORT = sys.argv[1], int(sys.argv[2])
PATIENCE_S = 30.0
CONTROLLER = "/joint_trajectory_controller"
JOINTS = ["A1", "A2", "A3", "A4", "A5", "A6", "A7"]

ros = roslibpy.Ros(host=HOST, port=PORT)
ros.run(PATIENCE_S)

joint_states = queue.Queue()
roslibpy.Topic(ros, "/joint_states", "sensor_msgs/msg/JointState").subscribe(joint_states.put)
state = joint_states.get(timeout=PATIENCE_S)
print("at", state["position"], "in the time of ROS 2:", sorted(state["header"]["stamp"]))

action = roslibpy.ActionClient(
    ros, CONTROLLER + "/follow_joint_trajectory", "control_msgs/action/FollowJointTrajectory"
)
feedback, results = queue.Queue(), queue.Queue()


def point(seconds, positions):
    return {"positions": positions, "velocities": [0.0] * 7, "time_from_start": {"sec": seconds}}


def send(*points):
    """Send a goal and return its id; its result comes into `results`."""
    goal = roslibpy.Goal({"trajectory": {"joint_names": JOINTS, "points": list(points)}})
    return action.send_goal(goal, results.put, feedback.put, results.put)


send(point(5, [0.2, 0.4, 0.0, -1.2, 0.0, 1.4, 0.0]), point(6, [0.0, 0.5236, 0.0, -1.0472, 0.0, 1.5708, 0.0]))
print("joint A1 is", round(feedback.get(timeout=PATIENCE_S)["actual"]["positions"][0], 3))
print("reached:", results.get(timeout=PATIENCE_S))

goal_id = send(point(20, [1.0, 0.4, 0.0, -1.2, 0.0, 1.4, 0.0]))
action.cancel_goal(goal_id)
print("cancelled:", results.get(timeout=PATIENCE_S))

send(point(1, [9.0] * 7))
print("rejected:", results.get(timeout=PATIENCE_S))
ros.terminate()
