"""Stiffness moves and gravity hold, as commands of the controller; every change of mode is in test_modes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from iiwa_sim.controller.errors import COMPONENT_NOT_READY, Refused
from iiwa_sim.controller.modes import Mode
from tests import asked
from tests.asked import (
    direct_joint_move,
    gravity_hold,
    joint_move,
    lin_move,
    lin_stiff_move,
    ptp_force_move,
    ptp_stiff_move,
    smart_joint_move,
)
from tests.stepped import ARMS, SteppedRobot, assert_straight, assert_within_limits, strong

START = [0.2, 0.4, -0.1, -1.2, 0.3, 0.9, -0.5]
AWAY = [0.6, 0.7, 0.1, -1.0, 0.5, 0.8, -0.2]
PLACES = {
    ARMS[0]: (START, AWAY),
    ARMS[1]: ([0.2, -1.4, 1.4, 0.3, 1.2, -0.5], [0.6, -1.2, 1.3, 0.5, 1.1, -0.2]),
}
both = pytest.mark.parametrize("name", ARMS)
FULL = [1.0] * 7
NO_FORCE = [0.0] * 6
LONGEST_STOP_S = 0.085  # of the KR 6; 0.072 of an iiwa


def at_start(name: str = ARMS[0]) -> SteppedRobot:
    robot = SteppedRobot(name)
    robot.goes_to(PLACES[name][0])
    return robot


def deflected(name: str = ARMS[0]) -> SteppedRobot:
    """In the middle of a stiffness move, pushed off it, and swinging."""
    robot = at_start(name)
    robot.controller.move(lin_stiff_move(robot.tcp_frame(PLACES[name][1]), 0.5, 800.0, NO_FORCE))
    robot.step(100)
    robot.controller.load.wrench = (30.0, -20.0, 10.0, 0.0, 1.0, 0.0)
    robot.step(30)
    return robot


def speeds(robot: SteppedRobot, last: int) -> np.ndarray:
    return np.abs(np.diff(robot.joints[-last:], axis=0)).max(axis=1) / robot.tick_s


def assert_positions_and_velocities_within_limits(robot: SteppedRobot) -> None:
    q, d = np.array(robot.joints), robot.description
    assert (q >= np.array(d.position_min)).all()
    assert (q <= np.array(d.position_max)).all()
    assert (np.abs(np.diff(q, axis=0)) <= np.array(d.velocity) * robot.tick_s * (1 + 1e-9)).all()


# Stiffness moves


@pytest.mark.requirement("FRC002", "FRC005", "FRC008", "FRC009")
@pytest.mark.parametrize("kind", ["lin", "ptp"])
@both
def test_without_forces_a_stiffness_move_is_the_move_itself(name: str, kind: str) -> None:
    soft, stiff = at_start(name), at_start(name)
    target = soft.tcp_frame(PLACES[name][1])
    soft.controller.move(getattr(asked, f"{kind}_stiff_move")(target, 0.5, 100.0, NO_FORCE))
    stiff.controller.move(getattr(asked, f"{kind}_move")(target, 0.5, 0.0))
    assert soft.controller.mode is Mode.IMPEDANCE
    assert soft.runs_until_stopped() == stiff.runs_until_stopped()
    assert soft.joints == stiff.joints
    if kind == "lin":
        assert_straight(soft, soft.joints, target)
    assert_within_limits(soft)


@pytest.mark.parametrize("stiffness", [200.0, 5000.0])
@both
def test_a_push_moves_the_robot_off_its_line_and_it_comes_to_rest_beside_the_target(
    name: str, stiffness: float
) -> None:
    robot = at_start(name)
    target = robot.tcp_frame(PLACES[name][1])
    robot.controller.move(lin_stiff_move(target, 0.5, stiffness, NO_FORCE))
    robot.controller.load.wrench = (0.0, 0.0, 10.0, 0.0, 0.0, 0.0)
    robot.runs_until_stopped()
    off = np.subtract(robot.controller.tool_frame()[:3], target[:3]) / 1000.0
    assert np.linalg.norm(off) == pytest.approx(10.0 / stiffness, rel=0.01)
    robot.controller.load.wrench = (0.0,) * 6
    robot.step()
    assert robot.controller.moving, "when it swings back it moves"
    robot.runs_until_stopped()
    np.testing.assert_allclose(robot.controller.tool_frame(), target, atol=0.1)
    robot.step(2000)
    np.testing.assert_allclose(robot.controller.tool_frame(), target, atol=1e-6)
    assert_positions_and_velocities_within_limits(robot)


def test_the_six_values_are_subtracted_from_what_acts() -> None:
    robot = at_start()
    here = robot.controller.tool_frame()
    pushed = (5.0, -3.0, 4.0, 0.5, 0.0, -0.5)
    robot.controller.load.wrench = pushed
    robot.controller.move(lin_stiff_move(here, 0.5, 1000.0, pushed))
    robot.runs_until_stopped()
    np.testing.assert_allclose(robot.controller.tool_frame(), here, atol=1e-9)
    robot.controller.load.wrench = (0.0,) * 6
    robot.controller.move(lin_stiff_move(here, 0.5, 1000.0, [0.0, 0.0, 10.0, 0.0, 0.0, 0.0]))
    robot.runs_until_stopped()
    pose = here.to_transform()
    off = np.subtract(robot.controller.tool_frame().to_transform().translation, pose.translation)
    z_axis = np.array(pose.rotation).reshape(3, 3)[:, 2]
    np.testing.assert_allclose(off, -0.010 * z_axis, atol=1e-4)
    assert robot.controller.cartesian_force() == (0.0,) * 6, "what the controller adds is not felt"


# Gravity hold


@pytest.mark.requirement("FRC001")
@pytest.mark.parametrize("stiffness", [50.0, 5000.0])
@both
def test_a_hold_deflects_by_torque_over_stiffness(name: str, stiffness: float) -> None:
    robot = at_start(name)
    start = PLACES[name][0]
    robot.controller.move(gravity_hold(stiffness))
    parts = (1.0, -2.0, 0.5, 1.5, -0.5, 1.0, 2.0)[: len(start)]
    torques = tuple(min(0.01 * stiffness, 10.0) * part for part in parts)
    robot.controller.load.joint_push = torques
    robot.step(3000)
    np.testing.assert_allclose(
        np.subtract(robot.controller.joints, start), np.array(torques) / stiffness, rtol=0.01
    )
    robot.controller.load.joint_push = (0.0,) * len(start)
    robot.step(3000)
    np.testing.assert_allclose(robot.controller.joints, start, atol=1e-6)
    robot.controller.load.wrench = (0.0, 0.0, 5.0, 0.0, 0.0, 0.0)
    robot.step(3000)
    off = np.subtract(robot.controller.joints, start)
    np.testing.assert_allclose(
        off, np.array(robot.controller.joint_torque()) / stiffness, rtol=0.01, atol=1e-6
    )
    assert robot.controller.moving
    assert robot.controller.mode is Mode.IMPEDANCE
    assert_positions_and_velocities_within_limits(robot)


def test_a_hold_without_stiffness_is_guided_by_hand_and_stays_where_it_is_left() -> None:
    robot = at_start()
    robot.controller.move(gravity_hold(0.0))
    robot.controller.load.wrench = (10.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    robot.step(500)
    robot.controller.load.wrench = (0.0,) * 6
    robot.step(1000)
    left = robot.controller.joints
    assert np.abs(np.subtract(left, START)).max() > 0.1
    robot.step(500)
    np.testing.assert_allclose(robot.controller.joints, left, atol=1e-6)


@pytest.mark.requirement("FRC013")
@pytest.mark.parametrize("force", [0.0, 15.0])
@both
def test_a_cancelled_stiffness_move_ends_on_its_path_and_the_robot_yields_on(name: str, force: float) -> None:
    robot = at_start(name)
    there = robot.tcp_frame(PLACES[name][1])
    first = robot.controller.move(lin_stiff_move(there, 0.3, 4000.0, NO_FORCE))
    robot.step(100)
    robot.cancel()
    assert not robot.controller.is_pending(first)
    robot.runs_until_stopped(0.1)
    here = robot.controller.tool_frame()
    assert_straight(robot, robot.joints, here)
    robot.controller.load.wrench = (0.0, 0.0, force, 0.0, 0.0, 0.0)
    robot.step(2000)
    off = np.subtract(robot.controller.tool_frame()[:3], here[:3])
    assert np.linalg.norm(off) == pytest.approx(force / 4.0, rel=0.01, abs=1e-6)
    robot.controller.move(lin_stiff_move(there, 0.3, 1000.0, NO_FORCE))
    robot.runs_until_stopped()
    assert_positions_and_velocities_within_limits(robot)


def test_a_hold_refuses_moves_of_other_modes_until_it_is_stopped() -> None:
    robot = at_start()
    controller = robot.controller
    hold = controller.move(gravity_hold(300.0))
    robot.step(50)
    target = robot.tcp_frame(AWAY)
    for command in (
        lambda: controller.move(joint_move(AWAY, FULL)),
        lambda: controller.move(lin_move(target, 0.5, 0.0)),
        lambda: controller.move(ptp_force_move(target, 0.5, 0.0, (None, None, 5.0))),
        lambda: controller.move(smart_joint_move(START, FULL)),
        lambda: controller.move(direct_joint_move(START, FULL)),
        controller.cancel_move,
    ):
        with pytest.raises(Refused, match="gravity hold") as refused:
            command()
        assert refused.value.code == COMPONENT_NOT_READY
    controller.clear_queue()
    robot.step(1000)
    assert controller.joints == tuple(START)
    assert controller.mode is Mode.IMPEDANCE
    assert controller.is_pending(hold)
    assert controller.moving
    robot.stop()
    assert not controller.is_pending(hold)
    assert controller.mode is Mode.UNKNOWN
    robot.runs_until_stopped(LONGEST_STOP_S)
    controller.move(smart_joint_move(AWAY, FULL))
    robot.runs_until_stopped()
    assert controller.joints == tuple(AWAY)


@both
def test_a_stiffness_move_takes_over_from_a_hold_where_the_robot_then_is(name: str) -> None:
    robot = at_start(name)
    controller = robot.controller
    hold = controller.move(gravity_hold(300.0))
    controller.load.joint_push = (3.0,) * len(PLACES[name][0])
    robot.step(60)
    before = len(robot.joints)
    assert speeds(robot, 2)[-1] > 0.01, "it swings"
    controller.load.joint_push = (0.0,) * len(PLACES[name][0])
    target = robot.tcp_frame(PLACES[name][1])
    controller.move(ptp_stiff_move(target, 0.5, 2000.0, NO_FORCE))
    assert not controller.is_pending(hold)
    robot.runs_until_stopped()
    np.testing.assert_allclose(controller.tool_frame(), target, atol=0.1)
    changes = np.abs(np.diff(robot.joints[before - 3 :], n=2, axis=0)).max() / robot.tick_s
    assert changes < 0.03, "no jump of the velocity"
    assert_positions_and_velocities_within_limits(robot)


# Moves replace each other


@pytest.mark.parametrize("kind", ["lin", "ptp"])
@both
def test_a_move_replaces_what_runs_in_mid_motion_within_the_limits(name: str, kind: str) -> None:
    robot = at_start(name)
    controller = robot.controller

    def move(*parameters: Any) -> int:
        return controller.move(getattr(asked, f"{kind}_stiff_move")(*parameters))

    first = move(robot.tcp_frame(PLACES[name][1]), 1.0, 2000.0, NO_FORCE)
    robot.step(100)
    assert speeds(robot, 2)[-1] > 0.1
    home = robot.tcp_frame(PLACES[name][0])
    second = move(home, 0.5, 2000.0, NO_FORCE)
    assert (controller.is_pending(first), controller.is_pending(second)) == (False, True)
    assert controller.queue == 0
    fastest = speeds(robot, 2)[-1]
    robot.step(2)
    assert speeds(robot, 2)[-1] > 0.8 * fastest, "no stop between"
    robot.runs_until_stopped()
    np.testing.assert_allclose(controller.tool_frame(), home, atol=1e-6)
    assert_within_limits(robot)


@pytest.mark.parametrize(("kind", "hz", "mm_per_s"), [("lin", 20, 20.0), ("ptp", 50, 100.0)])
def test_a_stream_is_followed_evenly_with_the_lag_of_the_documents(
    kind: str, hz: int, mm_per_s: float
) -> None:
    robot = SteppedRobot()
    frame = robot.controller.tool_frame()

    def move(*parameters: Any) -> int:
        return robot.controller.move(getattr(asked, f"{kind}_stiff_move")(*parameters))

    period = round(1.0 / hz / robot.tick_s)
    for k in range(2 * hz):
        move(frame._replace(y_mm=frame.y_mm + mm_per_s * (k + 1) / hz), 0.5, 2000.0, NO_FORCE)
        robot.step(period)
    y_mm = np.array([robot.tcp_frame(q).y_mm for q in robot.joints]) - frame.y_mm
    told = mm_per_s * robot.tick_s * np.arange(len(y_mm))
    settled = slice(len(y_mm) // 4, None)
    lag_s = (told - y_mm)[settled] / mm_per_s
    assert lag_s.max() <= 1.0 / hz + 0.02
    speed = np.diff(y_mm)[settled] / robot.tick_s
    assert speed == pytest.approx(mm_per_s, rel=0.05)
    robot.runs_until_stopped()
    np.testing.assert_allclose(robot.controller.tool_frame().y_mm, frame.y_mm + 2.0 * mm_per_s, atol=1e-6)
    assert_within_limits(robot)


# Leaving


@pytest.mark.requirement("FRC003", "FRC013")
@both
def test_a_stop_brakes_without_a_jump_and_takes_the_place_it_comes_to_as_the_new_start(name: str) -> None:
    robot = deflected(name)
    before = speeds(robot, 2)[-1]
    assert before > 0.1
    rest = robot.controller.motions.rest_after_stop()
    left = len(robot.joints)
    robot.controller.stop()
    robot.runs_until_stopped(LONGEST_STOP_S + robot.tick_s)
    assert robot.controller.joints == rest
    braking = speeds(robot, len(robot.joints) - left + 2)
    assert (braking <= before + 1e-9).all(), "slower and slower"
    steps = np.abs(np.diff(robot.joints[left - 2 :], n=2, axis=0)) / robot.tick_s**2
    assert (steps <= np.array(robot.description.stop_acceleration) * 1.01).all()
    robot.step(300)
    assert robot.controller.joints == rest, "stiff again: the push moves it no more"
    assert not robot.controller.moving
    assert_positions_and_velocities_within_limits(robot)


@pytest.mark.requirement("FRC003")
@both
def test_a_stop_of_a_robot_that_is_guided_uses_the_limits_of_a_stop_and_no_more(name: str) -> None:
    robot = SteppedRobot(strong(name))
    d = robot.description
    robot.controller.move(gravity_hold(0.0))
    # Against a damping of 5 Nms/rad that is 0.8 of the velocity limit.
    robot.controller.load.joint_push = (0.0,) * (len(d.joints) - 1) + (4.0 * d.velocity[-1],)
    robot.step(250)
    speed = float(np.diff(robot.joints[-2:], axis=0)[0, -1]) / robot.tick_s
    assert 0.7 < speed / d.velocity[-1] < 0.81
    robot.controller.stop()
    robot.step(50)
    q = np.array(robot.joints[-52:])
    acceleration, jerk = (np.abs(np.diff(q, n=n, axis=0)) / robot.tick_s**n for n in (2, 3))
    assert (acceleration / d.stop_acceleration).max() == pytest.approx(1.0, abs=0.005)
    assert 0.95 < (jerk / d.stop_jerk).max() < 1.05
    assert not robot.controller.moving


# Refused


# Whatever comes
