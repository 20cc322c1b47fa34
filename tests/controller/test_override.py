"""The override: on the path and within the planned limits, whatever moves and whenever it changes."""

from __future__ import annotations

from math import nan, nextafter
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.errors import Refused
from tests.requests import (
    direct_joint_move,
    joint_move,
    lin_move,
    smart_joint_move,
)
from tests.stepped import ARMS, SteppedRobot, assert_straight, assert_within_limits

FULL = [1.0] * 7
START = (0.2, 0.4, 0.0, -1.2, 0.1, 1.0, 0.0)
AWAY = (0.5, 0.3, -0.2, -1.0, 0.4, 1.0, -0.6)
ELSEWHERE = (-0.5, 0.6, 0.3, -1.4, 0.1, 1.2, 0.2)
PLACES = {
    ARMS[0]: (START, AWAY, ELSEWHERE),
    ARMS[1]: (
        (0.2, -1.4, 1.5, 0.1, 1.3, 0.0),
        (0.5, -1.2, 1.3, 0.4, 1.3, -0.6),
        (-0.5, -1.7, 1.8, 0.1, 1.5, 0.2),
    ),
}
names = st.sampled_from(ARMS)
values = st.one_of(st.floats(0.2, 1.0), st.sampled_from([0.0, 0.5, 1.0]))


@pytest.mark.requirement("FRC025")
@given(
    names,
    st.sampled_from([0.001, 0.002, 0.01]),
    st.lists(st.tuples(values, st.floats(0.0, 0.6)), min_size=1, max_size=8),
)
def test_a_line_stays_a_line_and_ends_at_its_target(
    name: str, tick_s: float, changes: list[tuple[float, float]]
) -> None:
    robot = SteppedRobot(name, tick_s=tick_s)
    frame = robot.controller.tool_frame()
    target = frame._replace(y_mm=frame.y_mm + 300.0, gamma=frame.gamma + 0.4)
    robot.controller.move(lin_move(target, 1.0, 0.0))
    for value, wait_s in changes:
        robot.step(round(wait_s / tick_s))
        robot.controller.set_override(value)
    robot.step(10)
    robot.controller.set_override(0.6)
    robot.runs_until_stopped()
    assert_straight(robot, robot.joints, target)
    assert_within_limits(robot)


@pytest.mark.requirement("FRC025")
@pytest.mark.parametrize("command", [joint_move, smart_joint_move, direct_joint_move])
def test_a_pause_takes_100_ms_and_its_end_300_ms(command: Any) -> None:
    robot = SteppedRobot()
    controller = robot.controller
    target = np.add(controller.joints, 0.08).tolist()
    controller.move(command(target, [0.01] * len(target)))
    robot.step(100)
    speed = speed_of(robot)
    controller.set_override(0.0)
    robot.step(50)
    assert speed_of(robot) == 0.0
    assert controller.moving
    assert not controller.under_way
    assert controller.status().in_motion == 0
    assert controller.motions.goal == tuple(target)
    controller.set_override(1.0)
    robot.step(150)
    assert speed_of(robot) == pytest.approx(speed, rel=1e-3)
    robot.runs_until_stopped()
    assert controller.joints == tuple(target)
    assert_within_limits(robot)


@pytest.mark.requirement("FRC003", "FRC025")
@pytest.mark.parametrize("pauses", [False, True])
def test_a_stop_and_a_pause_use_the_limits_of_a_stop_and_no_more(pauses: bool) -> None:
    robot = SteppedRobot()
    d = robot.description
    robot.controller.move(joint_move([q + 1.5 * (k == 0) for k, q in enumerate(d.home)], FULL))
    robot.step(300)
    speed = speed_of(robot)
    assert speed == pytest.approx(d.velocity[0], rel=1e-3)
    if pauses:
        robot.controller.set_override(0.0)
    else:
        robot.stop()
    robot.step(60)
    a1 = np.array(robot.joints[-63:])[:, 0]
    acceleration, jerk = (np.abs(np.diff(a1, n=n)).max() / robot.tick_s**n for n in (2, 3))
    assert acceleration == pytest.approx(speed * d.stop_rate_per_s, rel=1e-3)
    assert jerk == pytest.approx(speed * d.stop_rate_change_per_s2, rel=0.01)


def speed_of(robot: SteppedRobot) -> float:
    """Return the largest speed of a joint in the last tick (rad/s)."""
    return float(np.abs(np.subtract(robot.joints[-1], robot.joints[-2])).max()) / robot.tick_s


@pytest.mark.requirement("FRC025")
@pytest.mark.parametrize("command", [joint_move, smart_joint_move])
def test_an_override_set_during_a_stop_holds_for_the_next_move(command: Any) -> None:
    braking, resting = SteppedRobot(), SteppedRobot()
    for robot, ticks_of_braking in ((braking, 20), (resting, 200)):
        robot.controller.move(joint_move(ELSEWHERE, FULL))
        robot.step(150)
        robot.stop()
        robot.step(ticks_of_braking)
        robot.controller.set_override(0.3)
        robot.runs_until_stopped()
        robot.controller.move(command(AWAY, FULL))
        robot.joints = robot.joints[-1:]
        robot.runs_until_stopped()
    assert braking.joints == resting.joints


@pytest.mark.requirement("FRC025")
def test_an_override_out_of_range_is_refused_and_changes_nothing() -> None:
    """Below a millionth it would take years; 0 is a pause."""
    robot, twin = SteppedRobot(), SteppedRobot()
    for each in (robot, twin):
        each.controller.move(joint_move(AWAY, FULL))
        each.step(50)
    for value in (-0.01, 1.01, nan, 5e-324, nextafter(1e-6, 0.0)):
        with pytest.raises(Refused, match="override"):
            robot.controller.set_override(value)
        assert robot.controller.override == 1.0
    for each in (robot, twin):
        each.step(50)
    assert robot.joints == twin.joints
