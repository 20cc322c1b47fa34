"""Stiffness moves and gravity hold, as commands of the controller; every change of mode is in test_modes."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Plane
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.errors import COMPONENT_NOT_READY, Refused
from iiwa_sim.controller.modes import Mode
from iiwa_sim.frames import Frame, Vector, rotate, transpose
from iiwa_sim.motion.springs import LEAST_DAMPING_NS_PER_M, MASS_KG
from tests import requests
from tests.requests import (
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


def compliant_robot(
    name: str, stiffness: float, tick_s: float = 0.002, joints: Sequence[float] = ()
) -> SteppedRobot:
    """In a stiffness move to where it is; no torque stops it."""
    robot = SteppedRobot(strong(name), tick_s)
    robot.goes_to(joints or PLACES[name][0])
    robot.controller.move(lin_stiff_move(robot.controller.tool_frame(), 0.5, stiffness, NO_FORCE))
    return robot


def push_along(robot: SteppedRobot, force: Vector) -> None:
    """Push by a force in the axes of the base (N)."""
    turn = transpose(robot.tcp(robot.controller.joints).rotation)
    robot.controller.load.wrench = (*rotate(turn, force), 0.0, 0.0, 0.0)


def off_m(robot: SteppedRobot, last: int) -> np.ndarray:
    """Return the distance (m) of the TCP, in each of the last ticks, from its place before them."""
    places = np.array([robot.tcp(q).translation for q in robot.joints[-last - 1 :]])
    return places[1:] - places[0]


@pytest.mark.parametrize(("tick_s", "stiffness"), [(0.002, 5000.0), (0.01, 100.0)])
@both
def test_a_force_step_deflects_by_force_over_stiffness_with_damping_ratio_0_7(
    name: str, tick_s: float, stiffness: float
) -> None:
    robot = compliant_robot(name, stiffness, tick_s)
    home = robot.controller.joints
    push_along(robot, (0.01 * stiffness, -0.005 * stiffness, 0.0))
    ticks = round(3.0 / tick_s)
    robot.step(ticks)
    off = off_m(robot, ticks)
    frequency = sqrt(stiffness / MASS_KG)
    damped = frequency * sqrt(1.0 - 0.7**2)
    t = tick_s * np.arange(1, ticks + 1)
    step = 1.0 - np.exp(-0.7 * frequency * t) * (
        np.cos(damped * t) + 0.7 * frequency / damped * np.sin(damped * t)
    )
    # The push turns with the TCP, and the joints leave some micrometres over.
    np.testing.assert_allclose(off, step[:, None] * (0.01, -0.005, 0.0), atol=2e-5)
    robot.controller.load.wrench = (0.0,) * 6
    robot.step(round(5.0 / tick_s))
    assert robot.controller.joints == pytest.approx(home, abs=1e-6)
    assert_positions_and_velocities_within_limits(robot)


@both
def test_without_a_spring_the_robot_drifts_and_is_damped(name: str) -> None:
    robot = compliant_robot(name, 0.0, 0.01)
    push_along(robot, (0.0, 4.0, 0.0))
    robot.step(100)
    y = off_m(robot, 100)[:, 1]
    assert (y[-1] - y[-2]) / 0.01 == pytest.approx(4.0 / LEAST_DAMPING_NS_PER_M, rel=0.05)
    robot.controller.load.wrench = (0.0,) * 6
    robot.step(400)
    y = off_m(robot, 500)[:, 1]
    assert abs(y[-1] - y[-2]) < 1e-9
    assert y[-1] > 0.15, "nothing brings it back"


@pytest.mark.parametrize(("tick_s", "surface", "stiffness"), [(0.01, 1e3, 100.0), (0.002, 1e5, 5000.0)])
def test_pressed_on_a_surface_it_comes_to_rest_where_the_forces_balance(
    tick_s: float, surface: float, stiffness: float
) -> None:
    robot = compliant_robot(ARMS[0], stiffness, tick_s)
    plan_mm = robot.controller.tool_frame().z_mm
    top = Frame(0.0, 0.0, plan_mm + 10.0, 0.0, 0.0, 0.0).to_transform()  # the plan is 10 mm inside
    robot.controller.load.contact.put(Surface("table", Plane(), top, surface, 0.0, 0.0))
    robot.step(round(5.0 / tick_s))
    assert np.ptp(off_m(robot, round(0.1 / tick_s))) < 1e-6, "at rest"
    up_m = 1e-3 * (robot.controller.tool_frame().z_mm - plan_mm)
    assert up_m == pytest.approx(0.01 * surface / (surface + stiffness), rel=0.01)
    force_n = float(np.linalg.norm(robot.controller.cartesian_force()[:3]))
    assert force_n == pytest.approx(surface * (0.01 - up_m), rel=0.01)


pushes = st.tuples(st.tuples(*[st.floats(-3000.0, 3000.0)] * 6), st.tuples(*[st.floats(-300.0, 300.0)] * 7))


@settings(phases=[Phase.explicit, Phase.reuse, Phase.generate])
@given(
    name=st.sampled_from(ARMS),
    kicks=st.lists(pushes, min_size=1, max_size=4),
    stiffness=st.sampled_from([0.0, 100.0, 5000.0]),
    tick_s=st.sampled_from([0.002, 0.01]),
    parts=st.tuples(*[st.floats(0.0, 1.0)] * 7),
)
def test_no_push_takes_a_joint_beyond_its_limits(
    name: str,
    kicks: list[tuple[tuple[float, ...], tuple[float, ...]]],
    stiffness: float,
    tick_s: float,
    parts: tuple[float, ...],
) -> None:
    robot = SteppedRobot(strong(name), tick_s)
    controller, d = robot.controller, robot.description
    low, high = np.array(d.position_min), np.array(d.position_max)
    controller.place(np.clip(low + parts[: len(low)] * (high - low), low, high).tolist())
    robot.joints = [controller.joints]
    controller.move(ptp_stiff_move(controller.tool_frame(), 0.5, stiffness, NO_FORCE))
    for wrench, joint_push in kicks:
        controller.load.wrench, controller.load.joint_push = wrench, joint_push[: len(low)]
        robot.step(round(0.15 / tick_s))
    assert np.isfinite(robot.joints).all()
    assert_positions_and_velocities_within_limits(robot)


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


@pytest.mark.requirement("FRC002", "FRC005", "FRC008", "FRC009")
@pytest.mark.parametrize("kind", ["lin", "ptp"])
@both
def test_without_forces_a_stiffness_move_is_the_move_itself(name: str, kind: str) -> None:
    soft, stiff = at_start(name), at_start(name)
    target = soft.tcp_frame(PLACES[name][1])
    soft.controller.move(getattr(requests, f"{kind}_stiff_move")(target, 0.5, 100.0, NO_FORCE))
    stiff.controller.move(getattr(requests, f"{kind}_move")(target, 0.5, 0.0))
    assert soft.controller.mode is Mode.IMPEDANCE
    assert soft.runs_until_stopped() == stiff.runs_until_stopped()
    assert soft.joints == stiff.joints
    if kind == "lin":
        assert_straight(soft, soft.joints, target)
    assert_within_limits(soft)


def test_the_six_values_are_subtracted_from_the_external_wrench() -> None:
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


@pytest.mark.requirement("FRC013")
@pytest.mark.parametrize("force", [0.0, 15.0])
@both
def test_a_cancelled_stiffness_move_ends_on_its_path_still_compliant(name: str, force: float) -> None:
    robot = at_start(name)
    there = robot.tcp_frame(PLACES[name][1])
    first = robot.controller.move(lin_stiff_move(there, 0.3, 4000.0, NO_FORCE))
    robot.step(100)
    robot.cancel()
    assert not robot.controller.motions.is_pending(first)
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
    assert controller.motions.is_pending(hold)
    assert controller.moving
    robot.stop()
    assert not controller.motions.is_pending(hold)
    assert controller.mode is Mode.UNKNOWN
    robot.runs_until_stopped(LONGEST_STOP_S)
    controller.move(smart_joint_move(AWAY, FULL))
    robot.runs_until_stopped()
    assert controller.joints == tuple(AWAY)


@pytest.mark.parametrize(("kind", "hz", "mm_per_s"), [("lin", 20, 20.0), ("ptp", 50, 100.0)])
def test_a_stream_is_followed_evenly_with_the_documented_lag(kind: str, hz: int, mm_per_s: float) -> None:
    robot = SteppedRobot()
    frame = robot.controller.tool_frame()

    def move(*parameters: Any) -> int:
        return robot.controller.move(getattr(requests, f"{kind}_stiff_move")(*parameters))

    period = round(1.0 / hz / robot.tick_s)
    for k in range(2 * hz):
        move(frame._replace(y_mm=frame.y_mm + mm_per_s * (k + 1) / hz), 0.5, 2000.0, NO_FORCE)
        robot.step(period)
    y_mm = np.array([robot.tcp_frame(q).y_mm for q in robot.joints]) - frame.y_mm
    commanded = mm_per_s * robot.tick_s * np.arange(len(y_mm))
    settled = slice(len(y_mm) // 4, None)
    lag_s = (commanded - y_mm)[settled] / mm_per_s
    assert lag_s.max() <= 1.0 / hz + 0.02
    speed = np.diff(y_mm)[settled] / robot.tick_s
    assert speed == pytest.approx(mm_per_s, rel=0.05)
    robot.runs_until_stopped()
    np.testing.assert_allclose(robot.controller.tool_frame().y_mm, frame.y_mm + 2.0 * mm_per_s, atol=1e-6)
    assert_within_limits(robot)


@pytest.mark.requirement("FRC003", "FRC013")
@both
def test_a_stop_brakes_without_a_jump_and_the_next_move_starts_there(name: str) -> None:
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
