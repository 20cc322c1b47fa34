"""The modes: their table, and changes of mode in mid-motion."""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, TARGET_NOT_REACHABLE, ErrorRecord, Refused
from iiwa_sim.controller.modes import SERVO_MODES, Mode
from iiwa_sim.controller.planner import DIRECT_REACH_RAD
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.frames import Frame
from tests import requests
from tests.requests import (
    direct_cartesian_move,
    direct_joint_move,
    joint_move,
    lin_move,
    lin_stiff_move,
    ptp_stiff_move,
    smart_cartesian_move,
    smart_joint_move,
)
from tests.stepped import SteppedRobot, assert_within_limits

FULL = [1.0] * 7
START = [0.2, 0.4, -0.1, -1.2, 0.3, 0.9, -0.5]
AWAY = [1.2, 0.9, 0.5, -0.6, 1.3, 0.2, 1.5]
ELSEWHERE = [-0.4, 0.2, 0.3, -1.5, -0.3, 1.3, 0.4]
TICK_S = 0.002
STOP_TICKS = 50  # 100 ms


def near(robot: SteppedRobot, target: list[float]) -> list[float]:
    """Towards a target as far as a direct move may go, from where that would start."""
    here = start_of_target(robot.controller)
    return [q + max(-0.08, min(0.08, t - q)) for q, t in zip(here, target, strict=True)]


def rest_after_stop(controller: Controller) -> tuple[float, ...]:
    return controller.motions.rest_after_stop()


def start_of_target(controller: Controller) -> tuple[float, ...]:
    """Return the start of a direct move."""
    direct = controller.mode is Mode.DIRECT
    return controller.motions.present if direct else rest_after_stop(controller)


def near_flange(robot: SteppedRobot, target: list[float]) -> Frame:
    """Return the frame of the flange near these joints, with A3 where the move starts."""
    joints = near(robot, target)
    joints[2] = start_of_target(robot.controller)[2]
    return flange_at(robot, joints)


def flange_at(robot: SteppedRobot, joints: list[float]) -> Frame:
    return Frame.from_transform(robot.model.flange(joints))


SOFT = (2000.0, [0.0] * 6)
REQUESTS: dict[str, tuple[Mode, Callable[[SteppedRobot, list[float]], MoveRequest]]] = {
    "joint": (Mode.NORMAL, lambda _, to: joint_move(to, FULL)),
    "lin": (Mode.NORMAL, lambda robot, to: lin_move(robot.tcp_frame(to), 1.0, 0.0)),
    "linstiff": (Mode.IMPEDANCE, lambda robot, to: lin_stiff_move(robot.tcp_frame(to), 1.0, *SOFT)),
    "ptpstiff": (Mode.IMPEDANCE, lambda robot, to: ptp_stiff_move(robot.tcp_frame(to), 1.0, *SOFT)),
    "smart joint": (Mode.SMART, lambda _, to: smart_joint_move(to, FULL)),
    "smart cartesian": (Mode.SMART, lambda robot, to: smart_cartesian_move(flange_at(robot, to), 1.0)),
    "direct joint": (Mode.DIRECT, lambda robot, to: direct_joint_move(near(robot, to), FULL)),
    "direct cartesian": (
        Mode.DIRECT,
        lambda robot, to: direct_cartesian_move(near_flange(robot, to), 1.0),
    ),
}
COMMANDS = sorted(REQUESTS)
ONE_OF_EACH_MODE = ("joint", "linstiff", "smart joint", "direct cartesian")
SERVOS = [command for command in COMMANDS if REQUESTS[command][0] in SERVO_MODES]


def sends(robot: SteppedRobot, command: str, to: list[float]) -> int:
    number = robot.controller.move(REQUESTS[command][1](robot, to))
    robot.notice_mode()
    return number


def in_mid_motion(command: str) -> SteppedRobot:
    """Return a robot that moves fast, by a command, from START towards AWAY."""
    robot = SteppedRobot()
    robot.goes_to(START)
    sends(robot, command, AWAY)
    if REQUESTS[command][0] is Mode.DIRECT:
        for _ in range(20):
            robot.step(5)
            sends(robot, command, AWAY)
        robot.step(5)
    else:
        robot.step(120)
    assert np.abs(np.diff(robot.joints[-2:], axis=0)).max() > 0.5 * TICK_S, "hardly moves"
    return robot


@pytest.mark.requirement("FRA103")
@pytest.mark.parametrize(("command", "other"), list(permutations(ONE_OF_EACH_MODE, 2)))
def test_a_change_in_mid_motion_stops_on_the_path_and_then_begins(command: str, other: str) -> None:
    changed, stopped = in_mid_motion(command), in_mid_motion(command)
    number = sends(changed, other, ELSEWHERE)
    assert changed.controller.mode is REQUESTS[other][0]
    stopped.stop()
    ticks = stopped.runs_until_stopped(0.1)
    assert 0 < ticks <= STOP_TICKS
    for _ in range(ticks):
        assert changed.controller.moving
        assert changed.controller.motions.is_pending(number)
        changed.step()
    assert changed.joints == stopped.joints, "on its path, which a stop does not leave"
    changed.step(2)
    assert changed.joints[-1] != stopped.joints[-1], "begins within two ticks after it has come to rest"
    changed.runs_until_stopped()
    assert not changed.controller.motions.is_pending(number)
    if REQUESTS[other][0] is Mode.DIRECT:
        assert np.abs(np.subtract(changed.joints[-1], stopped.joints[-1])).max() == pytest.approx(0.08)
    else:
        goal, reached = changed.tcp(ELSEWHERE), changed.tcp(changed.joints[-1])
        assert np.allclose(goal.translation, reached.translation, atol=1e-9)
        assert np.allclose(goal.rotation, reached.rotation, atol=1e-9)
    assert_within_limits(changed)


@pytest.mark.parametrize("servo", ["smart", "direct"])
def test_the_relative_speeds_are_limits_of_each_joint(servo: str) -> None:
    speed_rel = 0.05
    robot = SteppedRobot()
    robot.goes_to(START)
    speeds = [speed_rel, *[1.0] * 6]
    robot.controller.move(getattr(requests, f"{servo}_joint_move")([q + 0.08 for q in START], speeds))
    robot.runs_until_stopped()
    fastest = np.abs(np.diff(robot.joints, axis=0)).max(axis=0) / TICK_S / robot.description.velocity
    assert fastest[0] == pytest.approx(speed_rel, rel=1e-6)
    assert fastest[1:].min() > 0.15


@pytest.mark.requirement("FRC005", "FRC018")
@pytest.mark.parametrize("servo", ["smart", "direct"])
def test_a_cartesian_servo_target_moves_the_flange_and_keeps_branch_and_redundancy(servo: str) -> None:
    robot = SteppedRobot()
    robot.goes_to(START)
    target = flange_at(robot, START)._replace(z_mm=flange_at(robot, START).z_mm - 20.0)
    robot.controller.move(getattr(requests, f"{servo}_cartesian_move")(target, 1.0))
    robot.runs_until_stopped()
    np.testing.assert_allclose(robot.controller.flange_frame(), target, atol=1e-7)
    assert robot.controller.joints[2] == pytest.approx(START[2], abs=1e-9)
    assert np.abs(np.subtract(robot.controller.joints, START)).max() < DIRECT_REACH_RAD


def test_a_direct_target_is_at_most_0_087_rad_away_on_any_axis() -> None:
    robot = SteppedRobot()
    robot.goes_to(START)
    for axis in range(7):
        target = list(START)
        target[axis] += 0.0871 * (-1) ** axis
        with pytest.raises(Refused, match=f"A{axis + 1} is 0.0871 rad") as refused:
            robot.controller.move(direct_joint_move(target, FULL))
        assert refused.value.code == TARGET_NOT_REACHABLE
        assert not robot.controller.moving
    target = [q + 0.087 for q in START]
    robot.controller.move(direct_joint_move(target, FULL))
    robot.runs_until_stopped()
    assert robot.controller.joints == tuple(target)


@pytest.mark.parametrize("command", SERVOS)
def test_a_servo_mode_without_commands_ends(command: str) -> None:
    robot = SteppedRobot(servo_timeout_s=0.03)
    robot.goes_to(START)
    for _ in range(10):
        number = sends(robot, command, AWAY)
        robot.step(15)
    assert robot.controller.mode is REQUESTS[command][0]
    assert robot.faults == []
    rest = rest_after_stop(robot.controller)
    robot.step()
    assert robot.controller.mode is Mode.UNKNOWN
    assert robot.controller.moving
    assert not robot.controller.motions.is_pending(number)
    robot.runs_until_stopped(0.1)
    assert robot.controller.joints == rest
    mode = REQUESTS[command][0].value
    assert robot.faults == [(COMMUNICATION_FAILURE, f"no {mode} command for 0.03 s: the robot stops")]
    assert robot.controller.errors.last == ErrorRecord(*robot.faults[0])
    robot.step(200)
    assert len(robot.faults) == 1
    assert_within_limits(robot)


@st.composite
def sequences(draw: st.DrawFn) -> list[tuple[str, int, int]]:
    """Return commands, each with the number of its target and the ticks before the next."""
    command = st.sampled_from([*COMMANDS, "stop", "refused"])
    return draw(st.lists(st.tuples(command, st.integers(0, 2), st.integers(0, 120)), min_size=2, max_size=12))


@pytest.mark.requirement("FRA104")
@given(sequence=sequences())
def test_any_commands_keep_the_limits_and_have_the_mode_of_the_table(
    sequence: list[tuple[str, int, int]],
) -> None:
    robot = SteppedRobot()
    robot.goes_to(START)
    mode = Mode.NORMAL
    for command, k, ticks in sequence:
        if command == "stop":
            robot.stop()
            mode = Mode.UNKNOWN
        elif command == "refused":
            with pytest.raises(Refused):
                robot.controller.move(smart_joint_move([9.0] * 7, FULL))
        else:
            try:
                sends(robot, command, [START, AWAY, ELSEWHERE][k])
            except Refused:  # of lines: not every one is possible
                assert "lin" in command
            else:
                mode = REQUESTS[command][0]
        assert robot.controller.mode is mode
        robot.step(ticks)
    robot.runs_until_stopped()
    assert_within_limits(robot)
