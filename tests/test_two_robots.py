"""Several robots in one cell, as drivers and test benches see them: by sockets, time passes for all."""

from __future__ import annotations

import json
import logging
import select
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from http.client import HTTPConnection
from pathlib import Path

import msgspec
import pytest

from iiwa_sim import Simulator
from iiwa_sim.backdoor.client import BackdoorClient
from iiwa_sim.cell.bodies import BoxSettings
from iiwa_sim.cli import main
from iiwa_sim.client.connection import Connection
from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.state import Snapshot
from iiwa_sim.options.sources import SettingError
from iiwa_sim.recordings.read import Recording
from iiwa_sim.recordings.schemas import DIALOGUE, STATE
from tests.processes import IIWA_SIM, refused, started
from tests.recordings.recorded import found_in
from tests.view.viewer import viewing

CELL = Path(__file__).parents[1] / "examples" / "two_iiwas.toml"
HEAD, _, _ = CELL.read_text().partition("[[robot]]")
DOWN, LEVEL = "3.14159265 0 3.14159265", "0 1.57079633 0"
OPEN, CLOSE, HOLDS = "set output : 1 0", "set output : 1 1", "get input : 3"
RESTS = "rests"
HAND_OVER = [
    ("left", f"ptp move : 550 -200 450 {DOWN} 0.5 0", "done"),
    ("left", f"lin move : 550 -200 400 {DOWN} 0.2 0", "done"),
    ("left", RESTS, "done"),
    ("left", CLOSE, "done"),
    ("left", HOLDS, "1"),
    ("left", f"lin move : 550 0 500 {DOWN} 0.5 0", "done"),
    ("right", f"ptp move : 680 0 455 {LEVEL} 0.5 0", "done"),
    ("left", RESTS, "done"),
    ("right", f"lin move : 740 0 455 {LEVEL} 0.2 0", "done"),
    ("right", RESTS, "done"),
    ("right", CLOSE, "done"),
    ("right", HOLDS, "1"),
    ("left", OPEN, "done"),
    ("left", HOLDS, "0"),
    ("left", f"lin move : 550 0 600 {DOWN} 0.5 0", "done"),
    ("right", f"lin move : 660 0 455 {LEVEL} 0.2 0", "done"),
    ("left", RESTS, "done"),
    ("right", RESTS, "done"),
]
"""Commands, and the reply that each is to have in the end."""


@pytest.fixture
def cell() -> Iterator[Simulator]:
    with Simulator(cell=CELL, clock="stepped", status_port=0, backdoor_port=0) as simulator:
        yield simulator


class Drivers:
    """A client of each robot."""

    def __init__(self, simulator: Simulator) -> None:
        self.simulator = simulator
        self.clients = {name: Connection(each.host, each.port, 60) for name, each in simulator.robots.items()}

    def __enter__(self) -> Drivers:
        return self

    def __exit__(self, *_: object) -> None:
        for each in self.clients.values():
            each.close()

    def ask(self, name: str, command: str) -> str:
        self.clients[name].send(command.encode() + b"\r\n")
        return self.clients[name].read().decode()

    def rests(self, name: str) -> str:
        while self.ask(name, "get status") == "moving":
            self.simulator.run_until_stopped()
        return "done"

    def hands_over(self, seen: Callable[[], None] = lambda: None) -> None:
        for name, command, reply in HAND_OVER:
            for _ in range(50):
                found = self.rests(name) if command == RESTS else self.ask(name, command)
                if found == reply:
                    break
                self.simulator.advance(0.1)
            assert found == reply, (name, command)
            seen()


def states(simulator: Simulator) -> list[Snapshot]:
    return [robot.state() for robot in simulator.robots.values()]


def test_a_part_is_handed_over_twice_with_the_same_bits() -> None:
    seen: list[list[object]] = [[], []]
    for run, clock in zip(seen, ("stepped", "fast"), strict=True):
        with Simulator(cell=CELL, clock=clock) as simulator, Drivers(simulator) as drivers:

            def look(run: list[object] = run, simulator: Simulator = simulator) -> None:
                left, right = states(simulator)
                run.append((left.joint_position, right.joint_position, left.parts, right.parts))

            simulator.pause()  # at rest time passes as the driver has it
            simulator.advance(0.2)  # the bar settles
            drivers.hands_over(look)
            left, right = states(simulator)
    assert seen[0] == seen[1]
    assert left.parts[0].state == right.parts[0].state == "held"
    assert left.gripper is not None
    assert left.gripper.state == "open"
    assert left.parts[0].frame[:3] == pytest.approx((630, 0, 460), abs=0.5)
    assert right.parts[0].frame[:3] == pytest.approx((660, 0, 460), abs=0.5)


def answers(simulator: Simulator, name: str) -> list[str]:
    """Return replies to a driver, while others rest."""
    replies = []
    with Drivers(simulator) as drivers:
        for command in (
            "hello",
            "get mode",
            f"lin move : 400 100 500 {DOWN} 0.5 0",
            "get status",
            "get joint position",
            "get cartesian force",
            "lin move : 2000 0 500 0 0 0 0.5 0",
            "get error",
            f"smart cartesian move : 450 100 500 {DOWN} 0.5",
            "get tool frame",
            "set output : 2 1",
            "get outputs",
        ):
            replies.append(drivers.ask(name, command))
            simulator.advance(0.05)
    return replies


def test_each_driver_is_answered_as_alone(tmp_path: Path) -> None:
    alone = tmp_path / "alone.toml"
    first = CELL.read_text().split("[[robot]]")[1].replace('name = "left"', "").replace("model", "robot")
    alone.write_text(first.replace("[robot.gripper]", "[gripper]"))
    with Simulator(cell=alone, clock="stepped") as simulator:
        expected = answers(simulator, "")
    assert "error" in expected
    with Simulator(cell=CELL, clock="stepped") as simulator:
        for name in simulator.robots:
            assert answers(simulator, name) == expected


def test_a_collision_stops_both_and_names_the_other(
    cell: Simulator, caplog: pytest.LogCaptureFixture
) -> None:
    for name, robot in cell.robots.items():
        robot.dialogue.remember()
        assert robot.name == name
    with Drivers(cell) as drivers, caplog.at_level(logging.WARNING):
        for name in cell.robots:
            drivers.ask(name, f"lin move : 750 0 450 {LEVEL} 0.2 0")
        cell.run_until_stopped()
        for name, other in (("left", "right"), ("right", "left")):
            reason = drivers.ask(name, "get error")
            assert reason.startswith("3060 protective stop: ")
            assert reason.endswith(f" of robot '{other}'")
            assert f"protective stop: {reason.split('stop: ')[1]}" in caplog.text
            assert drivers.ask(name, "get status") == "stopped"
            assert "protective stop" in cell.robots[name].dialogue.report()


def test_a_saved_state_is_that_of_the_whole_cell(cell: Simulator) -> None:
    left, right = (robot.backdoor for robot in cell.robots.values())
    with Drivers(cell) as drivers:
        for name, command, _ in HAND_OVER[:6]:
            drivers.rests(name) if command == RESTS else drivers.ask(name, command)
            cell.advance(1.0)
        left.save_state("carried")
        before = [(each.joint_position, each.parts, each.outputs) for each in states(cell)]
        for name, command, _ in HAND_OVER[6:10]:
            drivers.rests(name) if command == RESTS else drivers.ask(name, command)
        drivers.ask("right", CLOSE)
        right.add_surface(BoxSettings(name="wall", size_mm=(10, 10, 10), z_mm=2000, stiffness_n_per_m=1e4))
        cell.advance(0.5)
        right.restore_state("carried")
        assert [(each.joint_position, each.parts, each.outputs) for each in states(cell)] == before
        assert [each["name"] for b in (left, right) for each in b.cell()["surfaces"]] == ["table"] * 2
        assert left.states() == right.states() == ["start", "carried"]
        drivers.ask("left", f"lin move : 550 0 560 {DOWN} 0.5 0")
        with pytest.raises(Refused, match="all robots have to be at rest"):
            right.restore_state("start")
        drivers.rests("left")
        assert states(cell)[1].parts[0].state == "held"


def test_the_status_port_reports_each_robot_and_stops_all(cell: Simulator) -> None:
    schema = json.loads((Path(__file__).parents[1] / "protocol" / "status.schema.json").read_text())
    assert cell.status_port is not None
    with Drivers(cell) as drivers, socket.create_connection(("127.0.0.1", cell.status_port)) as reader:
        lines = reader.makefile("rb")
        while not select.select([reader], [], [], 0.01)[0]:  # it may not have been accepted yet
            cell.advance(0.1)
        for name in ("left", "right", "left", "right"):
            line = json.loads(lines.readline())
            assert (line["robot"], "robot" in schema["properties"]) == (name, True)
            assert msgspec.convert({k: v for k, v in line.items() if k != "robot"}, Snapshot)
        for name in cell.robots:
            drivers.ask(name, f"lin move : 400 0 500 {DOWN} 0.1 0")
        reader.sendall(b"stop\r\nhello\r\n")
        for _ in range(100):
            cell.advance(0.02)
            if not any(each.status == "moving" for each in states(cell)):
                break
        assert [each.error.code for each in states(cell)] == [3040, 3040]


def test_the_backdoor_has_a_path_for_each_robot(cell: Simulator) -> None:
    port = cell.backdoor_port
    assert port is not None
    BackdoorClient("127.0.0.1", port, robot="right").set_input(5, True)
    assert [each.inputs[4] for each in states(cell)] == [False, True]
    assert BackdoorClient("127.0.0.1", port, robot="left").state()["inputs"][4] is False
    for name in ("", "middle"):
        with pytest.raises(Refused, match="expected /ROBOT/state, with one of left, right"):
            BackdoorClient("127.0.0.1", port, robot=name).state()


def test_a_recording_has_all_robots_in_one_file(cell: Simulator, tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    with cell.record(file), Drivers(cell) as drivers:
        drivers.ask("right", f"lin move : 400 0 500 {DOWN} 0.5 0")
        cell.run_until_stopped()
    left, right = Recording(file), Recording(Path(f"{file}:right"))
    ticks = [[state.tick for state in each.contents(STATE)] for each in (left, right)]
    assert ticks[0] == ticks[1] == list(range(len(ticks[0])))
    ends = [[*each.contents(STATE)][-1].joint_position for each in (left, right)]
    assert ends[0] != ends[1]
    commands = [
        [line.text[:14] for line in each.contents(DIALOGUE) if line.mark == ">"] for each in (left, right)
    ]
    assert commands == [[], ["lin move : 400"]]
    frames = [each.content["transforms"] for each in found_in(file, "/left/tf", "/right/tf")][:2]
    children = [{(each["parent_frame_id"], each["child_frame_id"]) for each in found} for found in frames]
    assert ("world", "left/iiwa_link_0") in children[0]
    assert ("left/iiwa_link_0", "left/part bar") in children[0]
    assert ("world", "right/iiwa_link_0") in children[1]
    assert all(child.startswith("right/") for _, child in children[1])
    with pytest.raises(Exception, match="expected left or right behind the colon"):
        Recording(Path(f"{file}:middle"))


def test_a_simulator_of_two_robots_has_no_attributes_of_one(cell: Simulator) -> None:
    for name in ("port", "controller", "backdoor", "dialogue", "joints"):
        with pytest.raises(AttributeError, match=r"robots\[NAME\] has what belongs to one"):
            getattr(cell, name)
    for options in ({"port": 30000}, {"protocol": "krc4"}):
        with pytest.raises(SettingError, match="has those of each robot"):
            Simulator(cell=CELL, **options)
    with pytest.raises(SettingError, match="has several robots"):
        Simulator(cell=CELL, rosbridge_port=0)


def test_a_single_robot_may_have_a_name_and_a_base(tmp_path: Path) -> None:
    file = tmp_path / "cell.toml"
    right = CELL.read_text().split("[[robot]]")[2]
    file.write_text("[[robot]]" + right)
    with Simulator(cell=file, clock="stepped") as cell:
        assert cell.port == cell.robots["right"].port
        cell.advance(0.5)
        (bar,) = cell.state().parts
        assert bar.state == "lies", "on the table, which is turned with it"
        assert bar.frame[:2] == pytest.approx((740, 200), abs=0.1)


def shows_both(port: int) -> None:
    """The page of a port shows both robots in their places, and acts on each."""
    with closing(HTTPConnection("127.0.0.1", port, timeout=60)) as page:
        page.request("GET", "/")
        assert b"<html" in page.getresponse().read()
    with viewing(port) as viewer:
        viewer.until(lambda message: message.get("name", "").startswith("/robots/0/bodies/"))
        stands = viewer.until(lambda each: each.get("name") == "/robots/1" and "position" in each)
        assert stands["position"] == pytest.approx((1.29, 0.0, 0.0))
        viewer.clicks("Robot", "right")
        first = viewer.labelled("Emergency stop")
        stop = viewer.until(
            lambda each: each.get("props", {}).get("label") == "Emergency stop" and each["uuid"] != first
        )
        viewer.send(type="GuiUpdateMessage", uuid=stop["uuid"], updates={"value": True})
        viewer.shows("Emergency stop is PRESSED")
        assert not [each for each in viewer.seen if each.get("name", "").startswith("/robots/1/bodies/")]


def test_the_command_line_serves_each_robot_on_its_port_and_all_on_the_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with ExitStack() as taken:
        sockets = [taken.enter_context(socket.create_server(("127.0.0.1", 0))) for _ in range(2)]
        ports = [each.getsockname()[1] for each in sockets]
    text = CELL.read_text()
    for name, port in zip(("left", "right"), ports, strict=True):
        text = text.replace(f'name = "{name}"', f'name = "{name}"\nport = {port}')
    file, transcript = tmp_path / "cell.toml", tmp_path / "said.txt"
    file.write_text(text)
    options = ("--backdoor-port", "0", "--view-port", "0", "--transcript", str(transcript))
    with started(*IIWA_SIM, str(file), *options) as server:
        lines = [server.line().strip() for _ in range(4)]
        assert lines[:2] == [
            f"left listening on 127.0.0.1:{ports[0]}",
            f"right listening on 127.0.0.1:{ports[1]}",
        ]
        assert [line.split()[0] for line in lines[2:]] == ["backdoor", "page"]
        assert main(["health", str(server.process.pid)]) == 0
        client = Connection("127.0.0.1", ports[1], 60)
        client.send(b"wrong\r\n")
        assert client.read() == b"unknown command"
        client.close()
        page = int(lines[-1].rstrip("/").rpartition(":")[2])
        shows_both(page)
        code, errors = server.ends(signal.SIGTERM)
        with pytest.raises(OSError, match="refused"):
            socket.create_connection(("127.0.0.1", page), 60)
    assert code == 0
    assert "warning right 127.0.0.1:" in errors, "the log names the robot"
    assert "lost" not in errors
    assert "> wrong" in (tmp_path / "said-right.txt").read_text()
    assert "> wrong" not in (tmp_path / "said-left.txt").read_text()
    text = f"iiwa-sim: --port, --protocol: expected none: {file} has those of each robot\n"
    assert refused(file, "--port", "5") == text
    assert main(["check-cell", str(file)]) == 0
    text = capsys.readouterr().out
    assert all(f"robot {name}: LBR iiwa 7 R800, its TCP starts at " in text for name in ("left", "right"))
    assert text.count("part 'bar' lies\n") == 2


def test_the_fixture_has_all_robots_and_its_report_their_dialogues(pytester: pytest.Pytester) -> None:
    pytester.makeini("[pytest]\nasyncio_default_fixture_loop_scope = function\n")
    pytester.makepyfile(
        f"""
        import pytest
        from iiwa_sim import Iiwa

        @pytest.mark.iiwa(cell={str(CELL)!r})
        def test_fails(iiwa):
            with Iiwa(iiwa.host, iiwa.robots["right"].port) as right:
                right.get_mode()
            iiwa.robots["right"].dialogue.assert_said("get mode", times=1)
            iiwa.robots["left"].dialogue.assert_said("get mode", times=0)
            raise AssertionError("on purpose")
        """
    )
    result = pytester.runpytest_inprocess("-W", "error")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        ["*iiwa left dialogue*", "nothing was said", "*iiwa right dialogue*", "*> get mode"]
    )
    result.stdout.fnmatch_lines(["E*AssertionError: on purpose"])
