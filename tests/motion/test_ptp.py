"""PTP: straight in joint space, and as fast as the limits allow."""

import numpy as np
import pytest
import ruckig
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.robot.description import RobotDescription
from tests.stepped import SteppedRobot, assert_within_limits

joint_positions = st.tuples(*[st.floats(-1.9, 1.9, allow_subnormal=False)] * 7)
speeds = st.tuples(*[st.floats(0.05, 1.0)] * 7)


def optimal_duration_s(
    description: RobotDescription, start: tuple[float, ...], end: tuple[float, ...], speed_rel: float
) -> float:
    """What Ruckig needs for all joints together, phase-synchronised."""
    task = ruckig.InputParameter(len(start))
    task.current_position, task.target_position = list(start), list(end)
    task.max_velocity = (np.array(description.velocity) * speed_rel).tolist()
    task.max_acceleration, task.max_jerk = list(description.acceleration), list(description.jerk)
    task.synchronization = ruckig.Synchronization.Phase
    trajectory = ruckig.Trajectory(len(start))
    assert ruckig.Ruckig(len(start)).calculate(task, trajectory) == ruckig.Result.Working
    duration: float = trajectory.duration
    return duration


@pytest.mark.requirement("FRC004", "FRC010")
@settings(max_examples=60, deadline=None)
@given(start=joint_positions, end=joint_positions, speed_rel=st.floats(0.05, 1.0))
def test_joint_moves_take_little_longer_than_the_optimum(
    start: tuple[float, ...], end: tuple[float, ...], speed_rel: float
) -> None:
    # At one speed for all joints: otherwise Ruckig may give the straight line up for a faster way.
    robot = SteppedRobot()
    robot.goes_to(start)
    robot.controller.joint_move(end, [speed_rel] * 7)
    ticks = robot.runs_until_stopped()
    optimum = optimal_duration_s(robot.description, start, end, speed_rel)
    # At most twice the moving average's window of 48 ms for the smallest moves, and far less for all others.
    assert optimum - robot.tick_s <= ticks * robot.tick_s <= 1.02 * optimum + 0.096 + robot.tick_s
    if optimum > 0.1:
        assert ticks * robot.tick_s <= 1.02 * optimum + 0.03


@pytest.mark.requirement("FRC004", "FRC010")
@settings(max_examples=60, deadline=None)
@given(start=joint_positions, end=joint_positions, speeds_rel=speeds)
def test_joint_moves_are_straight_and_end_exactly(
    start: tuple[float, ...], end: tuple[float, ...], speeds_rel: tuple[float, ...]
) -> None:
    robot = SteppedRobot()
    robot.goes_to(start)
    robot.controller.joint_move(end, speeds_rel)
    robot.runs_until_stopped()
    assert robot.controller.joints == end
    assert_within_limits(robot)
    way = np.subtract(end, start)
    if np.abs(way).max() > 1e-6:
        q = np.array(robot.joints)
        parts = (q - start) @ way / (way @ way)
        np.testing.assert_allclose(q, start + parts[:, None] * way, atol=1e-12)
        assert (np.diff(parts) > -1e-12).all()


@pytest.mark.requirement("FRC004")
@settings(max_examples=30, deadline=None)
@given(end=joint_positions, speeds_rel=speeds)
def test_no_joint_is_faster_than_its_relative_speed(
    end: tuple[float, ...], speeds_rel: tuple[float, ...]
) -> None:
    robot = SteppedRobot()
    robot.controller.joint_move(end, speeds_rel)
    robot.runs_until_stopped()
    velocities = np.abs(np.diff(robot.joints, axis=0)) / robot.tick_s
    assert (velocities <= np.array(robot.description.velocity) * speeds_rel * (1 + 1e-9)).all()


@pytest.mark.requirement("FRC005", "FRC008")
@settings(max_examples=60, deadline=None)
@given(joints=joint_positions)
def test_ptp_to_a_frame_comes_to_the_frame(joints: tuple[float, ...]) -> None:
    robot = SteppedRobot()
    target = robot.tcp_frame(joints)
    robot.controller.ptp_move(target, 1.0, 0.0)
    robot.runs_until_stopped()
    reached, wanted = robot.tcp(robot.controller.joints), target.to_transform()
    np.testing.assert_allclose(reached.translation, wanted.translation, atol=1e-9)
    np.testing.assert_allclose(reached.rotation, wanted.rotation, atol=1e-9)
    assert_within_limits(robot)


@pytest.mark.requirement("FRC008")
@settings(max_examples=30, deadline=None)
@given(joints=joint_positions)
def test_ptp_with_redundancy_comes_to_that_a3(joints: tuple[float, ...]) -> None:
    robot = SteppedRobot()
    robot.controller.ptp_move(robot.tcp_frame(joints), 1.0, 0.0, joints[2])
    robot.runs_until_stopped()
    assert robot.controller.joints[2] == pytest.approx(joints[2], abs=1e-12)
