"""The robot as a node of ROS 1, with a real master and the tools of another terminal."""

from __future__ import annotations

import re
import signal
import sys
import xmlrpc.client
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from iiwa_sim.client import Iiwa
from iiwa_sim.ros import side
from iiwa_sim.ros.messages import interface, result_text
from tests.processes import (
    Process,
    fails,
    next_line,
    refused,
    running,
)
from tests.ros1_tools import SYSTEM_PYTHON, Terminal, master, needs_ros
from tests.talking import DEADLINE_S

TOPICS = {
    "/command_list": "robot_movement_interface/CommandList",
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
RESULT = "robot_movement_interface/Result"
LIST = "robot_movement_interface/CommandList"
PTP = "command_type: PTP, pose_type: JOINTS, velocity_type: '%', velocity: [0.5]"


def asked_of_a_publisher(terminal: Terminal, topic: str, kind: str) -> tuple[Any, ...]:
    """What one that the master knows of is asked by the first subscriber."""
    asked: list[tuple[Any, ...]] = []

    def request_topic(*parameters: Any) -> list[Any]:
        asked.append(parameters)
        return [0, "nothing to be had", []]

    with SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False) as server:
        server.timeout = DEADLINE_S
        server.register_function(request_topic, "requestTopic")
        uri = f"http://127.0.0.1:{server.server_address[1]}/"
        with xmlrpc.client.ServerProxy(terminal.master_uri) as proxy:
            proxy.registerPublisher("/early", topic, kind, uri)
            server.handle_request()
            proxy.unregisterPublisher("/early", topic, uri)
    return asked[0]


@pytest.fixture(scope="module")
def terminal(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Terminal]:
    needs_ros()
    with master(tmp_path_factory.mktemp("home")) as terminal:
        yield terminal


@pytest.fixture(scope="module")
def environment(terminal: Terminal) -> Iterator[Terminal]:
    """The environment of the terminal is set for this process."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        for name in ("HOME", "ROS_MASTER_URI", "ROS_IP"):
            monkeypatch.setenv(name, terminal.environment[name])
        yield terminal


@contextmanager
def on_ros(environment: Terminal) -> Iterator[Process]:
    with running("--ros") as process:
        assert process.line() == f"ROS node at {environment.master_uri}\n"
        yield process


class Sharing(ExitStack):
    """Has a robot that tests share, while there is one."""

    robot: Process | None = None


@pytest.fixture(scope="module")
def sharing() -> Iterator[Sharing]:
    with Sharing() as sharing:
        yield sharing


@pytest.fixture
def shared_robot(environment: Terminal, sharing: Sharing) -> Process:
    """A robot for tests that leave it as it was, but for where it stands."""
    if sharing.robot is None:
        sharing.robot = sharing.enter_context(on_ros(environment))
    return sharing.robot


@pytest.fixture
def alone(environment: Terminal, sharing: Sharing) -> None:
    """No robot is a node yet: another one would take its name from it."""
    del environment
    sharing.close()
    sharing.robot = None


@pytest.fixture
def robot(environment: Terminal, alone: None) -> Iterator[Process]:
    """A robot of the test's own, which it may end."""
    del alone
    with on_ros(environment) as process:
        yield process


@pytest.mark.requirement("FRA001", "FRA002")
@pytest.mark.usefixtures("shared_robot")
def test_topics_and_services_have_the_types_of_appendix_a(terminal: Terminal) -> None:
    told = terminal.python(
        "import rosgraph, rosservice; "
        "print(*(' '.join(each) for each in rosgraph.Master('/tests').getTopicTypes()), sep='\\n'); "
        f"print(*(name + ' ' + rosservice.get_service_type(name) for name in {list(SERVICES)}), sep='\\n')"
    )
    types = dict(line.split() for line in told.splitlines())
    assert {name: types[name] for name in TOPICS | SERVICES} == TOPICS | SERVICES


@pytest.mark.slow
@pytest.mark.requirement("FRA002")
def test_the_tools_know_the_types_with_the_published_sums(terminal: Terminal) -> None:
    """Types of ROS's own packages come from Debian here, the others from our folder of packages."""
    told = terminal.python(
        "from roslib.message import get_message_class, get_service_class\n"
        f"for name in {sorted(TOPICS.values())}: print(name, get_message_class(name)._md5sum)\n"
        f"for name in {sorted(SERVICES.values())}: print(name, get_service_class(name)._md5sum)"
    )
    known = dict(line.split() for line in told.splitlines())
    assert known.keys() == SUMS.keys()
    assert all(known[name].startswith(published) for name, published in SUMS.items())


@pytest.mark.requirement("FRA002", "FRA005")
def test_services_are_called_from_another_terminal(terminal: Terminal, shared_robot: Process) -> None:
    assert terminal.says("rosservice", "call", "/scale_speed", "value: 0.5").strip() == ""
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
    with Iiwa("127.0.0.1", shared_robot.port) as telnet:
        assert telnet.command("get override") == "0.01"
        telnet.set_override(1.0)
    code, said = terminal.runs("rosservice", "call", "/scale_speed", "value: .nan")
    assert code != 0
    assert "value: expected a finite number" in said


@pytest.mark.requirement("FRA001", "FRA002", "FRA005", "FRC015")
def test_lists_are_published_from_another_terminal(terminal: Terminal, shared_robot: Process) -> None:
    commands = (
        f"commands: [{{command_id: 1, {PTP}, pose: [0.3, 0.3, 0, -1.2, 0, 1, 0], blending_type: '%', "
        f"blending: [0.1]}}, {{command_id: 2, {PTP}, pose: [0.6, 0.5, 0, -1.2, 0, 1, 0]}}, "
        "{command_id: 3, command_type: CIRC}]"
    )
    with terminal.hearing("/command_result", "-n3", "-p") as echo:
        terminal.says("rostopic", "pub", "-1", "/command_list", LIST, commands)
        said, _ = echo.communicate(timeout=DEADLINE_S)
    header, *lines = [line for line in said.splitlines() if line]
    names = header.split(",")
    results = [dict(zip(names, line.split(","), strict=False)) for line in lines]
    assert [(each["field.command_id"], each["field.result_code"]) for each in results] == [
        ("1", "0"),
        ("2", "0"),
        ("3", "3000"),
    ]
    assert "command_type 'CIRC'" in results[2]["field.additional_information"]
    with Iiwa("127.0.0.1", shared_robot.port) as telnet:
        assert telnet.get_joint_position() == pytest.approx([0.6, 0.5, 0, -1.2, 0, 1, 0], abs=1e-6)


@pytest.mark.slow
@pytest.mark.requirement("FRA002")
@pytest.mark.usefixtures("alone")
def test_results_of_an_older_package_are_heard_by_its_clients(environment: Terminal) -> None:
    """The type of 2016 has no constants; a client that was built with it has another MD5 sum than today's."""
    header = interface("std_msgs/Header", "msg", ros2=False)[0]
    text = f"{result_text(2016)}{'=' * 80}\nMSG: std_msgs/Header\n{header.text}"
    script = (
        "import rospy\n"
        "from genpy.dynamic import generate_dynamic\n"
        f"made = generate_dynamic('{RESULT}', {text!r})['{RESULT}']\n"
        "rospy.init_node('older', anonymous=True, disable_rosout=True)\n"
        "heard = []\n"
        "subscriber = rospy.Subscriber('/command_result', made, heard.append)\n"
        "while not subscriber.get_num_connections(): rospy.sleep(0.01)\n"
        "print('hears', flush=True)\n"
        "while not heard: rospy.sleep(0.01)\n"
        "print(heard[0].command_id, heard[0].result_code)\n"
    )
    command = ("rostopic", "pub", "-1", "/command_list", LIST, "commands: [{command_id: 7}]")
    with (
        running("--ros", "--ros-result", "2016"),
        environment.starts(SYSTEM_PYTHON, "-c", script) as older,
    ):
        try:
            assert next_line(older) == "hears\n"
            environment.says(*command)
            assert next_line(older) == "7 3000\n"
        finally:
            older.kill()


@pytest.mark.requirement("FRA007", "FRA104", "FRA201")
@pytest.mark.slow
@pytest.mark.usefixtures("shared_robot")
def test_a_topic_comes_without_gaps(terminal: Terminal) -> None:
    """How many ticks lie between two messages is in tests/ros/test_appendix_a.py."""
    said = terminal.says("rostopic", "echo", "-n100", "-p", "/joint_states/header/seq")
    numbers = [int(line.split(",")[1]) for line in said.splitlines() if line[:1].isdigit()]
    assert len(numbers) == 100
    assert numbers == list(range(numbers[0], numbers[0] + 100))


@pytest.mark.slow
@pytest.mark.usefixtures("shared_robot")
def test_every_state_can_be_echoed(terminal: Terminal) -> None:
    topics = [topic for topic in TOPICS if not topic.startswith("/command")]
    told = terminal.python(
        "import rospy, rostopic\n"
        "rospy.init_node('echo', anonymous=True, disable_rosout=True)\n"
        f"for topic in {topics}:\n"
        "    print(topic, *str(rospy.wait_for_message(topic, rostopic.get_topic_class(topic)[0])).split())"
    )
    said = dict(line.split(" ", 1) for line in told.splitlines())
    assert list(said) == topics
    assert "effort: []" in said["/joint_states"]
    assert re.search("alpha: .* beta: .* gamma: ", said["/tool_frame"])
    assert "in_motion: val: 0" in said["/robot_status"]
    assert said["/current_speed_scale"] == "data: 1.0"
    assert said["/io_states"].count("pin_number") == 32


@pytest.mark.slow
def test_a_flood_delays_neither_ticks_nor_others_nor_the_end(terminal: Terminal, robot: Process) -> None:
    """Lists as long as are taken, by publishers who do nothing else."""
    script = (
        "import roslib.message, rospy\n"
        f"made = roslib.message.get_message_class('{LIST}')\n"
        "wrong = type(made().commands)(roslib.message.get_message_class("
        "'robot_movement_interface/Command')(command_type='CIRC') for _ in range(1000))\n"
        "rospy.init_node('flood', anonymous=True, disable_rosout=True)\n"
        "publisher = rospy.Publisher('/command_list', made, queue_size=1)\n"
        "while not publisher.get_num_connections(): pass\n"
        "print('begins', flush=True)\n"
        "while True: publisher.publish(made(commands=wrong))\n"
    )
    _assert_others_are_served_during(script, terminal, robot)


@pytest.mark.slow
def test_at_the_end_the_master_forgets_the_node(terminal: Terminal, robot: Process) -> None:
    assert terminal.nodes_at("/joint_states") == ["/iiwa_sim"]
    assert robot.ends(signal.SIGTERM) == (0, "")
    assert terminal.nodes_at("/joint_states") == []


@pytest.mark.slow
def test_a_master_that_is_started_anew_is_told_of_the_node(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    needs_ros()
    with ExitStack() as robots:
        with master(tmp_path) as before:
            for name in ("HOME", "ROS_MASTER_URI", "ROS_IP"):
                monkeypatch.setenv(name, before.environment[name])
            robot = robots.enter_context(running("--ros"))
            assert robot.line().startswith("ROS node at ")
        with master(tmp_path, int(before.master_uri.rpartition(":")[2])) as anew:
            asked = asked_of_a_publisher(anew, "/command_list", LIST)  # most often before the robot is back
            assert asked[:2] == ("/iiwa_sim", "/command_list")
            with anew.hearing("/command_result", "-n1") as echo:
                anew.says("rostopic", "pub", "-1", "/command_list", LIST, "commands: [{command_id: 7}]")
                assert "command_id: 7" in echo.communicate(timeout=DEADLINE_S)[0]
            assert anew.says("rosservice", "call", "/get_io", "number: 1") == "value: False\nerror: 0\n"
            assert anew.nodes_at("/joint_states") == ["/iiwa_sim"]
            log = _stops(robot)
            assert "the ROS master no longer knew this node: it has registered again" in log
            assert "Traceback" not in log, log
            assert anew.nodes_at("/joint_states") == []


@pytest.mark.slow
def test_without_a_master_one_line_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    needs_ros()
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


def _stops(robot: Process) -> str:
    code, log = robot.ends(signal.SIGTERM)
    assert code == 0
    return log


def _assert_others_are_served_during(flood_script: str, terminal: Terminal, robot: Process) -> None:
    """The script says when it begins, and goes on for ever, also while the robot ends."""
    with terminal.starts(SYSTEM_PYTHON, "-c", flood_script) as flood:
        try:
            assert next_line(flood) == "begins\n"
            _hear(terminal, "/tool_frame", 200)
            assert terminal.says("rosservice", "call", "/get_io", "number: 1") == "value: False\nerror: 0\n"
            assert flood.poll() is None
            log = _stops(robot)
        finally:
            flood.kill()
    assert "fault" not in log
    assert "Traceback" not in log, log


def _hear(terminal: Terminal, topic: str, count: int) -> None:
    """All these messages arrive, however long it takes; they would not fit into any buffer."""
    with terminal.starts("rostopic", "echo", f"-n{count}", topic) as echo:
        try:
            echo.communicate(timeout=5 * DEADLINE_S)  # thousands take a minute on a busy machine
            assert echo.returncode == 0
        finally:
            echo.kill()
