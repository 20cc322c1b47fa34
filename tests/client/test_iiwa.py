"""The client `Iiwa` at a real simulator."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Iterator

import pytest

from iiwa_sim import Drop, Split
from iiwa_sim.client import CommandError, Frame, Iiwa, LastError, ReplyError, RobotStatus, UnknownCommandError
from iiwa_sim.controller.modes import Mode
from iiwa_sim.simulator import Simulator
from tests.line_client import DEADLINE_S

JOINTS = (0.1, 0.5, -0.25, -1.0, 0.0, 1.4, 0.5)


@pytest.fixture
def simulator() -> Iterator[Simulator]:
    with Simulator(clock="fast") as simulator:
        yield simulator


@pytest.fixture
def robot(simulator: Simulator) -> Iterator[Iiwa]:
    with Iiwa(simulator.host, simulator.port, DEADLINE_S) as robot:
        yield robot


def test_the_client_imports_nothing_of_the_server() -> None:
    command = [sys.executable, "-c", "import sys, iiwa_sim.client; print(*sys.modules)"]
    loaded = set(subprocess.run(command, capture_output=True, text=True, check=True).stdout.split())
    assert not loaded & {"pinocchio", "numpy", "ruckig", "msgspec"}
    assert all(name.startswith("iiwa_sim.client") for name in loaded if name.startswith("iiwa_sim."))


@pytest.mark.requirement("FRA005")
def test_moves_end_at_their_targets(simulator: Simulator, robot: Iiwa) -> None:
    robot.hello()
    robot.joint_move(JOINTS, speeds=[0.5] * 7)
    robot.wait_until_stopped(DEADLINE_S)
    assert robot.get_joint_position() == pytest.approx(JOINTS)
    start = robot.get_tool_frame()
    down = start._replace(z=start.z - 20)
    zeros = [0.0] * 6
    for move in (
        lambda: robot.lin_move(down, speed=0.5, blending=0),
        lambda: robot.ptp_move(start, 0.5, 0),
        lambda: robot.linr_move(down, 0.5, 0, r=-0.25),
        lambda: robot.ptpr_move(start, 0.5, 0, -0.25),
        lambda: robot.linforcez_move(down, 0.5, 0, thresholdZ=10),
        lambda: robot.ptpforcez_move(start, 0.5, 0, 10),
        lambda: robot.linforce_move(down, 0.5, 0, 10, 10, 10),
        lambda: robot.ptpforce_move(start, 0.5, 0, 10, 10, 10),
        lambda: robot.lin_relative_move((0, 0, -20, 0, 0, 0), 0.5, 0),
        lambda: robot.linstiff_move(start, 0.5, 2000, zeros),
        lambda: robot.ptpstiff_move(down, 0.5, 2000, zeros),
        lambda: robot.command("lin tool relative move", *zeros, 0.5, 0),
        lambda: robot.ptp_move(start, 0.5, 0),
    ):
        move()
        robot.wait_until_stopped(DEADLINE_S)
    assert robot.get_tool_frame() == pytest.approx(start, abs=1e-6)
    position, flange = robot.get_joint_position(), robot.get_flange_frame()
    for servo in (
        lambda: robot.smart_joint_move(position, [0.5] * 7),
        lambda: robot.smart_cartesian_move(flange, 0.5),
        lambda: robot.direct_joint_move(position, [0.5] * 7),
        lambda: robot.direct_cartesian_move(flange, 0.5),
    ):
        servo()
    robot.stop()
    robot.start_gravity(100.0)
    assert robot.get_mode() == "impedance"
    assert simulator.call(lambda: simulator.controller.mode) is Mode.IMPEDANCE
    robot.bye()
    with pytest.raises(ConnectionError, match="this connection is closed"):
        robot.hello()


@pytest.mark.requirement("FRA007", "FRC017", "FRC018", "FRC021")
def test_status_is_read_into_values(robot: Iiwa) -> None:
    assert robot.get_status() == "stopped"
    assert robot.get_queue() == 0
    assert robot.get_error() == LastError(0, "none")
    assert robot.get_robot_status() == RobotStatus(2, 0, 1, 1, 0, 0, 0)
    assert robot.get_tool_frame() == pytest.approx(
        Frame(450.0, 0.0, 520.41, 0.0, -math.pi / 2, 0.0), abs=0.01
    )
    assert len(robot.get_joint_torque()) == 7
    assert robot.get_cartesian_force().fz == pytest.approx(0.0, abs=1e-3)
    robot.set_override(0.25)
    assert robot.command("get override") == "0.25"
    robot.set_tool_load(1.5, (0, 10, 60))
    assert robot.command("get tool load") == "1.5 0.0 10.0 60.0"
    robot.set_output(2, True)
    assert (robot.get_output(2), robot.get_output(3), robot.get_input(2)) == (True, False, False)
    assert "lin move : x[mm]" in robot.help("lin\nmove")
    with pytest.raises(CommandError, match=r"error to 'lin move.*: 3021 the TCP at 5000") as rejected:
        robot.lin_move((5000, 0, 0, 0, 0, 0), 0.5, 0)
    assert rejected.value.code == 3021
    assert rejected.value.reason.startswith("the TCP at 5000")
    assert robot.get_error().code == 3021
    robot.reset_error()
    assert robot.get_error().code == 0
    with pytest.raises(UnknownCommandError, match="'get lost'"):
        robot.command("get lost")


@pytest.mark.parametrize("reply", ["done", "1 2 3 4 5 6", "1 2 3 4 5 6 7 8", "1 2 3 4 5 6 nan"])
def test_a_reply_that_does_not_fit_ends_the_connection(simulator: Simulator, robot: Iiwa, reply: str) -> None:
    simulator.reply("get joint position", reply)
    with pytest.raises(ReplyError, match="'get joint position' was answered"):
        robot.get_joint_position()
    with pytest.raises(ConnectionError, match="this connection is closed"):
        robot.hello()
    robot.reconnect()
    robot.hello()


def test_a_lost_reply_ends_the_connection_and_a_split_one_does_not(simulator: Simulator) -> None:
    with Iiwa(simulator.host, simulator.port, 0.2) as robot:
        simulator.backdoor.set_fault(Split(3, 0.01))
        assert robot.get_status() == "stopped"
        simulator.backdoor.clear_faults()
        simulator.backdoor.set_fault(Drop())
        with pytest.raises(TimeoutError, match=r"no answer to 'get status' within 0\.2 s"):
            robot.get_status()
        with pytest.raises(ConnectionError):
            robot.get_status()
