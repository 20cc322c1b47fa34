"""The robot as a node of ROS 1, with a real master and the tools of another terminal, as Debian has them."""

from __future__ import annotations

import contextlib
import os
import shutil
import socket
import subprocess
import sys
import xmlrpc.client
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from iiwa_sim.client import Iiwa
from iiwa_sim.ros import side
from tests.needed import lacks
from tests.processes import IIWA_SIM, Process, fails, refused, running, succeeds
from tests.talking import DEADLINE_S, wait_until

SYSTEM_PYTHON = "/usr/bin/python3"
LIST = "robot_movement_interface/CommandList"
TOPICS = {
    "/command_list": LIST,
    "/command_result": "robot_movement_interface/Result",
    "/robot_status": "industrial_msgs/RobotStatus",
    "/tool_frame": "robot_movement_interface/EulerFrame",
    "/joint_states": "sensor_msgs/JointState",
    "/current_speed_scale": "std_msgs/Float32",
    "/io_states": "robot_movement_interface/IOStates",
}
SERVICES = {
    "/scale_speed": "robot_movement_interface/SetFloat",
    "/get_io": "robot_movement_interface/GetIO",
    "/set_io": "robot_movement_interface/SetIO",
    "/stop_robot_right_now": "std_srvs/Trigger",
    "/robot/get_digital_ios": "robot_movement_interface/GetDigitalIOs",
    "/robot/set_digital_ios": "robot_movement_interface/SetDigitalIOs",
}
SUMS = {
    "industrial_msgs/RobotStatus": "b733cb45",
    "robot_movement_interface/CommandList": "d584975b",
    "robot_movement_interface/EulerFrame": "a80a1671",
    "robot_movement_interface/GetDigitalIOs": "cbb85a79",
    "robot_movement_interface/GetIO": "554345d0",
    "robot_movement_interface/IOStates": "9760d0cf",
    "robot_movement_interface/Result": "c42e143b65ad82ebad12c76fe9d39bb7",
    "robot_movement_interface/SetDigitalIOs": "de845eb3",
    "robot_movement_interface/SetFloat": "0aca93dc",
    "robot_movement_interface/SetIO": "ecf42524",
    "sensor_msgs/JointState": "3066dcd76a6cfaef579bd0f34173e9fd",
    "std_msgs/Float32": "73fcbf46b49191e672908e50842a83d4",
    "std_srvs/Trigger": "937c9679a518e3a18d831e57125ea522",
}
"""The published MD5 sums, or their beginnings."""
PTP = "command_type: PTP, pose_type: JOINTS, velocity_type: '%', velocity: [0.5]"


class Terminal:
    """Where ROS_MASTER_URI and ROS_PACKAGE_PATH are set."""

    def __init__(self, master_uri: str, home: Path) -> None:
        self.master_uri = master_uri
        self.own = {"HOME": str(home), "ROS_MASTER_URI": master_uri, "ROS_IP": "127.0.0.1"}
        packages = succeeds([*IIWA_SIM, "ros-package-path"]).strip()
        here = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        self._environment = here | self.own | {"ROS_PACKAGE_PATH": packages, "PYTHONUNBUFFERED": "1"}

    def starts(self, *command: str) -> subprocess.Popen[str]:
        pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        environment = self._environment
        return subprocess.Popen(command, env=environment, stdin=subprocess.DEVNULL, text=True, **pipes)

    def runs(self, *command: str) -> tuple[int, str]:
        """Exit code and output."""
        with self.starts(*command) as process:
            try:
                said, _ = process.communicate(timeout=5 * DEADLINE_S)
            finally:
                process.kill()
        return process.returncode, said

    def says(self, *command: str) -> str:
        """The output of what must succeed."""
        code, said = self.runs(*command)
        assert code == 0, said
        return said

    def python(self, script: str) -> str:
        """What a script says in the Python that ROS is installed for."""
        return self.says(SYSTEM_PYTHON, "-c", script)

    def nodes_at(self, topic: str, *, subscribers: bool = False) -> list[str]:
        """The nodes that the master has for a topic."""
        with xmlrpc.client.ServerProxy(self.master_uri) as proxy:
            state: Any = proxy.getSystemState("/tests")
        nodes: list[str] = dict(state[2][1 if subscribers else 0]).get(topic, [])
        return nodes

    @contextmanager
    def hearing(self, topic: str, *options: str) -> Iterator[subprocess.Popen[str]]:
        """A `rostopic echo` that the robot knows of."""
        with self.starts("rostopic", "echo", *options, topic) as echo:
            try:
                wait_until(lambda: echo.poll() is not None or self.nodes_at(topic, subscribers=True) != [])
                assert echo.poll() is None, echo.communicate()[0]
                yield echo
            finally:
                echo.kill()


@contextmanager
def master(home: Path, port: int = 0) -> Iterator[Terminal]:
    """A terminal with a ROS master, at a free port if none is given; this process has its environment."""
    if not (side.SYSTEM_PACKAGES / "rospy").is_dir() or not shutil.which("rosservice"):
        lacks("ROS 1 of Debian's packages")
    if not port:
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
    terminal = Terminal(f"http://127.0.0.1:{port}", home)
    with (
        pytest.MonkeyPatch.context() as monkeypatch,
        terminal.starts("rosmaster", "--core", "-p", str(port)) as process,
    ):
        for name, value in terminal.own.items():
            monkeypatch.setenv(name, value)

        def listens() -> bool:
            assert process.poll() is None, process.communicate()[0]
            with contextlib.suppress(OSError):
                return terminal.nodes_at("/none") == []
            return False

        try:
            wait_until(listens)
            yield terminal
        finally:
            process.kill()


@contextmanager
def on_ros(terminal: Terminal, *options: str) -> Iterator[Process]:
    with running("--ros", *options) as process:
        assert process.line() == f"ROS node at {terminal.master_uri}\n"
        yield process


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Terminal, Process]]:
    """A robot for tests that leave it as it was, but for where it stands."""
    with master(tmp_path_factory.mktemp("home")) as terminal, on_ros(terminal) as robot:
        yield terminal, robot


@pytest.mark.requirement("FRA001", "FRA002")
def test_topics_and_services_have_the_types_of_appendix_a(shared: tuple[Terminal, Process]) -> None:
    terminal, _ = shared
    told = terminal.python(
        "import rosgraph, rosservice; "
        "print(*(' '.join(each) for each in rosgraph.Master('/tests').getTopicTypes()), sep='\\n'); "
        f"print(*(name + ' ' + rosservice.get_service_type(name) for name in {list(SERVICES)}), sep='\\n')"
    )
    types = dict(line.split() for line in told.splitlines())
    assert {name: types[name] for name in TOPICS | SERVICES} == TOPICS | SERVICES


@pytest.mark.requirement("FRA002")
def test_the_tools_know_the_types_with_the_published_sums(shared: tuple[Terminal, Process]) -> None:
    """Types of ROS's own packages come from Debian here, the others from our folder of packages."""
    told = shared[0].python(
        "from roslib.message import get_message_class, get_service_class\n"
        f"for name in {sorted(TOPICS.values())}: print(name, get_message_class(name)._md5sum)\n"
        f"for name in {sorted(SERVICES.values())}: print(name, get_service_class(name)._md5sum)"
    )
    known = dict(line.split() for line in told.splitlines())
    assert known.keys() == SUMS.keys()
    assert all(known[name].startswith(published) for name, published in SUMS.items())


@pytest.mark.slow
@pytest.mark.requirement("FRA002", "FRA005")
def test_services_are_called_from_another_terminal(shared: tuple[Terminal, Process]) -> None:
    terminal, robot = shared
    calls = {
        "/scale_speed": [{"value": -3.0}],
        "/set_io": [{"number": 3, "value": True}, {"number": 17, "value": True}],
        "/get_io": [{"number": 3}, {"number": 99}],
        "/stop_robot_right_now": [{}],
        "/robot/get_digital_ios": [{"ios": [{"group_id": "DO", "pin_number": 3}]}],
    }
    told = terminal.python(
        "import rosservice\n"
        f"for name, requests in {calls}.items():\n"
        "    for each in requests: print(name, *str(rosservice.call_service(name, [each])[1]).split())"
    )
    *others, ios = told.splitlines()
    assert others == [
        "/scale_speed",
        "/set_io error: 0",
        "/set_io error: 2",
        "/get_io value: True error: 0",
        "/get_io value: False error: 1",
        "/stop_robot_right_now success: True message: ''",
    ]
    assert ios.startswith('/robot/get_digital_ios ios: - id: group_id: "DO" pin_number: 3 value: True ')
    with Iiwa("127.0.0.1", robot.port) as telnet:
        assert telnet.command("get override") == "0.01"
        telnet.set_override(1.0)
    code, said = terminal.runs("rosservice", "call", "/scale_speed", "value: .nan")
    assert code != 0
    assert "value: expected a finite number" in said


@pytest.mark.slow
@pytest.mark.requirement("FRA001", "FRA002", "FRA005", "FRC015")
def test_lists_are_published_from_another_terminal(shared: tuple[Terminal, Process]) -> None:
    terminal, robot = shared
    commands = (
        f"commands: [{{command_id: 1, {PTP}, pose: [0.3, 0.3, 0, -1.2, 0, 1, 0], blending_type: '%', "
        f"blending: [0.1]}}, {{command_id: 2, {PTP}, pose: [0.6, 0.5, 0, -1.2, 0, 1, 0]}}, "
        "{command_id: 3, command_type: CIRC}]"
    )
    with terminal.hearing("/command_result", "-n3", "-p") as echo:
        terminal.says("rostopic", "pub", "-1", "/command_list", LIST, commands)
        said, _ = echo.communicate(timeout=DEADLINE_S)
    header, *lines = [line.split(",") for line in said.splitlines() if line]
    results = [dict(zip(header, line, strict=False)) for line in lines]
    codes = [(each["field.command_id"], each["field.result_code"]) for each in results]
    assert codes == [("1", "0"), ("2", "0"), ("3", "3000")]
    assert "command_type 'CIRC'" in results[2]["field.additional_information"]
    with Iiwa("127.0.0.1", robot.port) as telnet:
        assert telnet.get_joint_position() == pytest.approx([0.6, 0.5, 0, -1.2, 0, 1, 0], abs=1e-6)


def test_without_a_master_one_line_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not (side.SYSTEM_PACKAGES / "rospy").is_dir():
        lacks("ROS 1 of Debian's packages")
    uri = "http://127.0.0.1:1"
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("ROS_MASTER_URI", uri)
    told = fails("--port", "0", "--ros")
    assert told.startswith(f"iiwa-sim: no ROS master at {uri}: start one (roscore")


@pytest.mark.requirement("FRA005")
def test_without_rospy_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(side, "SYSTEM_PYTHON", Path(sys.executable))
    said = refused("--port", "0", "--ros")
    assert said.startswith("iiwa-sim: --ros needs rospy (")
    assert "apt install python3-rospy" in said
