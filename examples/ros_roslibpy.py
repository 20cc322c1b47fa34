"""A robot on rosbridge, driven with roslibpy: two moves with blending, results, services.

iiwa-sim --rosbridge-port 9090
python examples/ros_roslibpy.py 127.0.0.1 9090
"""

import queue
import sys

import roslibpy

HOST, PORT = sys.argv[1], int(sys.argv[2])
PATIENCE_S = 30.0


def command(number, kind, pose_type, pose, **fields):
    """Return a Command at half speed; missing fields have ROS's defaults."""
    speed = {"velocity_type": "%", "velocity": [0.5]}
    return {
        "command_id": number,
        "command_type": kind,
        "pose_type": pose_type,
        "pose": pose,
        **speed,
        **fields,
    }


ros = roslibpy.Ros(host=HOST, port=PORT)
ros.run(PATIENCE_S)

results = queue.Queue()
joint_states = queue.Queue()
roslibpy.Topic(ros, "/command_result", "robot_movement_interface/Result").subscribe(results.put)
roslibpy.Topic(ros, "/joint_states", "sensor_msgs/JointState").subscribe(joint_states.put)
print("at", joint_states.get(timeout=PATIENCE_S)["position"])

commands = roslibpy.Topic(ros, "/command_list", "robot_movement_interface/CommandList")
rounded = {"blending_type": "M", "blending": [0.05]}
moves = [
    command(1, "PTP", "JOINTS", [0.3, 0.3, 0.0, -1.2, 0.0, 1.3, 0.0]),
    command(2, "LIN", "EULER_INTRINSIC_ZYX", [0.5, 0.3, 0.5, 0.0, 3.1416, 0.0], **rounded),
    command(3, "LIN", "QUATERNION", [0.6, 0.2, 0.4, 0.0, 1.0, 0.0, 0.0]),
    command(4, "CIRC", "JOINTS", [0.0] * 7),
]
commands.publish(roslibpy.Message({"commands": moves, "replace_previous_commands": True}))
for _ in moves:
    result = results.get(timeout=PATIENCE_S)
    print("command", result["command_id"], "->", result["result_code"], result["additional_information"])


def call(name, kind, **request):
    """Call a service, and print its response."""
    service = roslibpy.Service(ros, name, kind)
    print(name, request, "->", dict(service.call(roslibpy.ServiceRequest(request), timeout=PATIENCE_S)))


call("/scale_speed", "robot_movement_interface/SetFloat", value=0.5)
call("/set_io", "robot_movement_interface/SetIO", number=5, value=True)
call("/get_io", "robot_movement_interface/GetIO", number=5)
call("/stop_robot_right_now", "std_srvs/Trigger")
call(
    "/robot/set_digital_ios",
    "robot_movement_interface/SetDigitalIOs",
    ios=[{"id": {"group_id": "DO", "pin_number": 6}, "value": True}],
)
call(
    "/robot/get_digital_ios",
    "robot_movement_interface/GetDigitalIOs",
    ios=[{"group_id": "DO", "pin_number": 6}],
)
ros.terminate()
