"""PTP: straight in joint space, and as fast as the limits allow."""

import numpy as np
import pytest
import ruckig
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.robot.description import RobotDescription, load_robot
from tests.requests import joint_move, ptp_move
from tests.stepped import ARMS, VELOCITY_TOLERANCE, SteppedRobot, assert_within_limits

DESCRIPTIONS = [load_robot(name) for name in ARMS]
BOTH = pytest.mark.parametrize("description", DESCRIPTIONS, ids=lambda description: description.name)
SHARE_OF_LIMITS = 0.9


def positions(description: RobotDescription) -> st.SearchStrategy[tuple[float, ...]]:
    """Return joint positions (rad) nearly anywhere."""
    limits = zip(description.position_min, description.position_max, strict=True)
    within = [(0.5 * (low + high), 0.5 * SHARE_OF_LIMITS * (high - low)) for low, high in limits]
    return st.tuples(*[st.floats(mid - delta, mid + delta, allow_subnormal=False) for mid, delta in within])


def speeds(description: RobotDescription) -> st.SearchStrategy[tuple[float, ...]]:
    return st.tuples(*[st.floats(0.05, 1.0)] * len(description.joints))


def optimal_duration_s(
    description: RobotDescription,
    start: tuple[float, ...],
    end: tuple[float, ...],
    speeds_rel: tuple[float, ...],
) -> float:
    """Return Ruckig's duration along the straight line, within the limits of all joints there."""
    delta = np.abs(np.subtract(end, start))
    longest = float(delta.max())
    if longest == 0.0:
        return 0.0
    parts = np.maximum(delta / longest, 1e-9)
    task = ruckig.InputParameter(1)
    task.current_position, task.target_position = [0.0], [longest]
    task.max_velocity = [float((np.multiply(description.velocity, speeds_rel) / parts).min())]
    task.max_acceleration = [float((description.acceleration / parts).min())]
    task.max_jerk = [float((description.jerk / parts).min())]
    trajectory = ruckig.Trajectory(1)
    assert ruckig.Ruckig(1).calculate(task, trajectory) == ruckig.Result.Working
    duration: float = trajectory.duration
    return duration


@pytest.mark.requirement("FRC004", "FRC010")
@BOTH
@given(data=st.data())
def test_joint_moves_are_straight_and_exact_and_take_little_longer_than_the_optimum(
    description: RobotDescription, data: st.DataObject
) -> None:
    start, end = data.draw(positions(description)), data.draw(positions(description))
    speeds_rel = data.draw(speeds(description))
    robot = SteppedRobot(description)
    robot.goes_to(start)
    robot.controller.move(joint_move(end, speeds_rel))
    ticks = robot.runs_until_stopped()
    assert robot.controller.joints == end
    optimum = optimal_duration_s(description, start, end, speeds_rel)
    assert optimum - robot.tick_s <= ticks * robot.tick_s <= 1.02 * optimum + 0.03 + robot.tick_s
    assert_within_limits(robot)
    velocities = np.abs(np.diff(robot.joints, axis=0)) / robot.tick_s
    assert (velocities <= np.array(description.velocity) * speeds_rel * VELOCITY_TOLERANCE).all()
    delta = np.subtract(end, start)
    if np.abs(delta).max() > 1e-6:
        q = np.array(robot.joints)
        parts = (q - start) @ delta / (delta @ delta)
        np.testing.assert_allclose(q, start + parts[:, None] * delta, atol=1e-12)
        assert (np.diff(parts) > -1e-12).all()


@pytest.mark.requirement("FRC005", "FRC008")
@BOTH
@given(data=st.data())
def test_ptp_to_a_frame_ends_in_the_frame(description: RobotDescription, data: st.DataObject) -> None:
    robot = SteppedRobot(description)
    target = robot.tcp_frame(data.draw(positions(description)))
    robot.controller.move(ptp_move(target, 1.0, 0.0))
    robot.runs_until_stopped()
    reached, wanted = robot.tcp(robot.controller.joints), target.to_transform()
    np.testing.assert_allclose(reached.translation, wanted.translation, atol=1e-9)
    np.testing.assert_allclose(reached.rotation, wanted.rotation, atol=1e-9)
    assert_within_limits(robot)


@pytest.mark.requirement("FRC008")
@given(joints=positions(DESCRIPTIONS[0]))
def test_ptp_with_a_redundancy_ends_with_that_a3(joints: tuple[float, ...]) -> None:
    robot = SteppedRobot()
    robot.controller.move(ptp_move(robot.tcp_frame(joints), 1.0, 0.0, joints[2]))
    robot.runs_until_stopped()
    assert robot.controller.joints[2] == pytest.approx(joints[2], abs=1e-12)
