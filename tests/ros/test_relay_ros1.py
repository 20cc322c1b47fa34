"""The robot as a node of ROS 1, with a real master, a user's node by rospy and a tool, as Debian has them."""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import pytest

from iiwa_sim.client import Iiwa
from iiwa_sim.ros import side
from tests.line_client import wait_until
from tests.peers import lacks
from tests.processes import Process, next_line, refused, running, started

PYTHON = "/usr/bin/python3"
RMI = "robot_movement_interface"
TOPICS = {
    "/command_list": (f"{RMI}/CommandList", "d584975b"),
    "/command_result": (f"{RMI}/Result", "c42e143b65ad82ebad12c76fe9d39bb7"),
    "/robot_status": ("industrial_msgs/RobotStatus", "b733cb45"),
    "/tool_frame": (f"{RMI}/EulerFrame", "a80a1671"),
    "/joint_states": ("sensor_msgs/JointState", "3066dcd76a6cfaef579bd0f34173e9fd"),
    "/current_speed_scale": ("std_msgs/Float32", "73fcbf46b49191e672908e50842a83d4"),
    "/io_states": (f"{RMI}/IOStates", "9760d0cf"),
}
SERVICES = {
    "/scale_speed": (f"{RMI}/SetFloat", "0aca93dc"),
    "/get_io": (f"{RMI}/GetIO", "554345d0"),
    "/set_io": (f"{RMI}/SetIO", "ecf42524"),
    "/stop_robot_right_now": ("std_srvs/Trigger", "937c9679a518e3a18d831e57125ea522"),
    "/robot/get_digital_ios": (f"{RMI}/GetDigitalIOs", "cbb85a79"),
    "/robot/set_digital_ios": (f"{RMI}/SetDigitalIOs", "de845eb3"),
}
"""Types, and the published MD5 sums or their beginnings."""
CALLS = [
    ("/scale_speed", {"value": -3.0}, ""),
    ("/scale_speed", {"value": float("nan")}, "override nan: expected 0, or"),
    ("/scale_speed", {"value": 1.0}, ""),
    ("/set_io", {"number": 3, "value": True}, "error: 0"),
    ("/set_io", {"number": 17, "value": True}, "error: 2"),
    ("/get_io", {"number": 3}, "value: True error: 0"),
    ("/get_io", {"number": 99}, "value: False error: 1"),
    ("/stop_robot_right_now", {}, "success: True message: ''"),
    ("/robot/get_digital_ios", {"ios": [{"group_id": "DO", "pin_number": 3}]}, "pin_number: 3 value: True"),
]
PTP = "command_type: PTP, pose_type: JOINTS, velocity_type: '%', velocity: [0.5]"
COMMANDS = (
    f"commands: [{{command_id: 1, {PTP}, pose: [0.3, 0.3, 0, -1.2, 0, 1, 0], blending_type: '%', "
    f"blending: [0.1]}}, {{command_id: 2, {PTP}, pose: [0.6, 0.5, 0, -1.2, 0, 1, 0]}}, "
    "{command_id: 3, command_type: CIRC}]"
)
USER = """
import json, sys, rosgraph, rospy, rosservice
from roslib.message import get_message_class, get_service_class

topics, services, calls = json.loads(sys.argv[1])
rospy.init_node("rosservice", anonymous=True)  # as call_service does
there = dict(rosgraph.Master("/user").getTopicTypes())
kinds = {name: [there[name], get_message_class(there[name])._md5sum] for name in topics}
for name in services:
    kind = rosservice.get_service_type(name)
    kinds[name] = [kind, get_service_class(kind)._md5sum]
answers = []
for name, request, _ in calls:
    try:
        answers.append(" ".join(str(rosservice.call_service(name, [request])[1]).split()))
    except rosservice.ROSServiceException as fault:
        answers.append(str(fault))
results, states = [], []
listener = rospy.Subscriber("/command_result", get_message_class(there["/command_result"]), results.append)
joints = rospy.Subscriber("/joint_states", get_message_class(there["/joint_states"]), states.append)
while not listener.get_num_connections() or not states:
    rospy.sleep(0.01)
print(json.dumps([kinds, answers, list(states[0].name)]), flush=True)
while len(results) < 3:
    rospy.sleep(0.01)
rows = [[each.command_id, each.result_code, each.additional_information] for each in results]
print(json.dumps(rows), flush=True)
"""


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Process]:
    """A robot at a master of its own, at which programs of this process's environment are, too."""
    if not Path("/usr/lib/python3/dist-packages/rospy").is_dir() or not shutil.which("rostopic"):
        lacks("ROS 1 of Debian's packages")
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    for name, value in {
        "HOME": str(tmp_path),
        "ROS_MASTER_URI": f"http://127.0.0.1:{port}",
        "ROS_IP": "127.0.0.1",
        "ROS_PACKAGE_PATH": str(files("iiwa_sim.protocol") / "rmi"),
    }.items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("PYTHONPATH", raising=False)
    with subprocess.Popen(["rosmaster", "--core", "-p", str(port)], stdout=subprocess.DEVNULL) as master:
        try:
            wait_until(lambda: _listens(port))
            with running("--ros") as process:
                assert process.line() == f"ROS node at http://127.0.0.1:{port}\n"
                yield process
        finally:
            master.kill()


def _listens(port: int) -> bool:
    with socket.socket() as connection:
        return connection.connect_ex(("127.0.0.1", port)) == 0


@pytest.mark.requirement("FRA001", "FRA002", "FRA005", "FRC015")
def test_a_users_node_and_a_tool_drive_the_robot(robot: Process) -> None:
    """The user's types of our packages are those of the folder protocol/rmi."""
    asked = json.dumps([list(TOPICS), list(SERVICES), CALLS])
    with subprocess.Popen([PYTHON, "-c", USER, asked], stdout=subprocess.PIPE, text=True) as user:
        kinds, answers, joints = json.loads(next_line(user))
        for name, (kind, published) in (TOPICS | SERVICES).items():
            assert kinds[name][0] == kind
            assert kinds[name][1].startswith(published), name
        for (name, request, words), answer in zip(CALLS, answers, strict=True):
            assert words in answer, (name, request)
        assert joints == [f"A{k}" for k in range(1, 8)]
        with started("rostopic", "pub", "-1", "/command_list", f"{RMI}/CommandList", COMMANDS):
            results = json.loads(next_line(user))
    assert [each[:2] for each in results] == [[1, 0], [2, 0], [3, 3000]]
    assert "command_type 'CIRC'" in results[2][2]
    with Iiwa("127.0.0.1", robot.port) as telnet:
        assert telnet.get_joint_position() == pytest.approx([0.6, 0.5, 0, -1.2, 0, 1, 0], abs=1e-6)


def test_without_a_master_the_end_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not Path("/usr/lib/python3/dist-packages/rospy").is_dir():
        lacks("ROS 1 of Debian's packages")
    uri = "http://127.0.0.1:1"
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("ROS_MASTER_URI", uri)
    line = refused("--port", "0", "--ros")
    assert line.startswith(f"iiwa-sim: no ROS master at {uri}: start one (roscore")


@pytest.mark.requirement("FRA005")
def test_without_rospy_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(side, "SYSTEM_PYTHON", Path(sys.executable))
    line = refused("--port", "0", "--ros")
    assert line.startswith("iiwa-sim: --ros needs rospy (")
    assert "apt install python3-rospy" in line
