"""Overlaps: two chains that move at once keep the limits, whenever the robot's ticks fall."""

from dataclasses import replace

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from iiwa_sim.motion.chain import Chain, Way
from iiwa_sim.motion.corner import turning_share
from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.overlap import set_out_s
from iiwa_sim.motion.ptp import JointLine
from iiwa_sim.motion.sampled_path import Joints
from iiwa_sim.motion.slices import at_once
from iiwa_sim.motion.zone import JointBall
from iiwa_sim.robot.description import load_robot
from tests.stepped import TOLERANCE, SteppedRobot, worst_loads

SHORTEST_TICK_S = 0.001
PHASES = 8
LIMITS = JointLimits(np.array([1.7, 2.0, 3.0]), np.array([8.0, 10.0, 15.0]), np.array([200.0, 250.0, 375.0]))
FAR = np.full(3, 10.0)

ways = st.tuples(*[st.floats(-0.5, 0.5)] * 3) | st.tuples(*[st.floats(-0.03, 0.03)] * 3)
speeds = st.sampled_from([1.0, 0.7, 0.3, 0.1])


def move(number: int, start: Joints, way: Joints, speed_rel: float) -> Move:
    end = tuple(np.add(start, way).tolist())
    limits = LIMITS.at_speed(speed_rel)
    length_s = float((np.abs(way) / limits.velocity).max())
    return Move(
        number, JointLine(start, end), limits, length_s, JointBall(0.4, start, end), start, lambda _: None
    )


def joints_at(chain: Chain, times: Array) -> Array:
    start = chain.joints(0.0)
    return np.array([start if t <= 0.0 else chain.joints(t) for t in times.tolist()])


@settings(max_examples=60, deadline=None)
@given(ways, ways, speeds, speeds)
def test_at_any_phase_of_the_shortest_tick_both_together_keep_the_limits(
    one: Joints, other: Joints, speed_rel: float, other_speed_rel: float
) -> None:
    assume(min(np.abs(one).max(), np.abs(other).max()) > 1e-3)
    first = move(1, (0.0, 0.0, 0.0), one, speed_rel)
    second = move(2, first.path.end, other, other_speed_rel)
    share = turning_share(first, second)
    way = Way(first)
    way.end_share = share
    braking, leaving = at_once(Chain.along(way)), at_once(Chain.along(Way(second), share))
    start_s = at_once(set_out_s(braking, leaving, 0.0, -FAR, FAR))
    assume(start_s is not None)
    assert start_s is not None
    for phase in np.arange(PHASES) / PHASES * SHORTEST_TICK_S:
        times = np.arange(start_s - 0.004 + phase, braking.rest_s + 0.004, SHORTEST_TICK_S)
        q = joints_at(braking, times) + joints_at(leaving, times - start_s) - np.array(braking.end)
        velocity = np.maximum(first.limits.velocity, second.limits.velocity)
        for order, limit in enumerate((velocity, LIMITS.acceleration, LIMITS.jerk), start=1):
            load = np.abs(np.diff(q, n=order, axis=0)) / SHORTEST_TICK_S**order / limit
            assert load.max() <= TOLERANCE


def test_jerks_that_add_up_for_a_millisecond_are_seen() -> None:
    """Between the steps in which an overlap was looked at, 4 % too much once hid."""
    home = (0.04688, 0.75107, -0.10084, -0.88091, -0.01179, 1.59385, -0.7192)
    first = (0.04538, 0.75196, -0.10257, -0.88161, -0.01143, 1.59433, -0.71875)
    second = (-0.3596, 0.74237, -0.02881, -0.52873, 0.15035, 1.7475, -1.07974)
    third = (-0.3327, 0.68904, -0.11705, -1.05543, -0.08656, 1.42611, -1.70622)
    robot = SteppedRobot(replace(load_robot(), home=home), SHORTEST_TICK_S)
    robot.controller.joint_move(first, (0.7, 0.5, 0.7, 0.5, 0.5, 0.05, 0.05))
    robot.controller.ptp_move(robot.tcp_frame(second), 0.7, 500.0, second[2])
    robot.controller.ptp_move(robot.tcp_frame(third), 0.05, 0.0, third[2])
    robot.runs_until_stopped()
    assert worst_loads(robot)["jerk"] <= 1.0
