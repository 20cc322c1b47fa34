"""Whatever is asked of joints, tick by tick: they stay within their limits, and can brake at any tick."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.motion.braking import Braking
from iiwa_sim.motion.joint_bounds_kernel import JointBounds, braking_way
from iiwa_sim.robot.description import RobotDescription, load_robot
from tests.stepped import ARMS

ROBOT = load_robot()
STOP = ROBOT.stop_acceleration, ROBOT.stop_jerk


@given(
    robot=st.sampled_from([load_robot(name) for name in ARMS]),
    tick_s=st.sampled_from([0.001, 0.002, 0.01]),
    parts=st.tuples(*[st.floats(0.0, 1.0)] * 7),
    wanted=st.lists(st.tuples(*[st.floats(-0.2, 0.2)] * 7), min_size=1, max_size=6),
)
def test_who_keeps_the_bounds_keeps_the_limits_also_when_braking(
    robot: RobotDescription, tick_s: float, parts: tuple[float, ...], wanted: list[tuple[float, ...]]
) -> None:
    count = len(robot.joints)
    low, high = np.array(robot.position_min), np.array(robot.position_max)
    stop = robot.stop_acceleration, robot.stop_jerk
    bounds = JointBounds(tick_s, robot.position_min, robot.position_max, robot.velocity, *stop)
    joints: tuple[float, ...] = tuple(np.clip(low + parts[:count] * (high - low), low, high).tolist())
    way = np.zeros(count)
    for every in wanted:
        step = every[:count]
        for _ in range(40):
            least, greatest = bounds.ways(joints)
            way = np.clip(step, least, greatest)
            after = tuple((np.array(joints) + way).tolist())
            a_hair_less = np.sign(way) * np.maximum(np.abs(way) - 1e-12, 0.0)
            assert bounds.allow(joints, tuple((np.array(joints) + a_hair_less).tolist()))
            joints = after
            assert (low - 1e-12 <= joints).all()
            assert (joints <= high + 1e-12).all()
            assert (np.abs(way) <= np.array(robot.velocity) * tick_s * (1 + 1e-12)).all()
            # What braking from here would need, before any clipping.
            for q, w, a, j, lower, upper in zip(joints, way, *stop, low, high, strict=True):
                room = upper - q if w > 0 else q - lower
                assert braking_way(abs(w) / tick_s, a, j) <= room + 1e-9
    velocity = (way / tick_s).tolist()
    braking = Braking(bounds, tick_s, *stop)
    rest = braking.rest(joints, velocity)
    braking.start(joints, velocity)
    last = np.array(joints)
    ticks = 0
    while braking.active:
        place = np.array(braking.step())
        assert (np.abs(place - last) <= np.abs(way) + 1e-12).all(), "never faster"
        last, ticks = place, ticks + 1
    assert tuple(last.tolist()) == rest
    # From full speed with full jerk and full acceleration: 72 ms on an iiwa, 85 ms on the KR 6.
    longest_s = np.divide(robot.velocity, stop[0]) + np.divide(*stop)
    assert ticks * tick_s <= float(longest_s.max()) + tick_s <= 0.1 + tick_s


def test_beyond_the_bounds_is_not_allowed() -> None:
    bounds = JointBounds(0.002, ROBOT.position_min, ROBOT.position_max, ROBOT.velocity, *STOP)
    here = ROBOT.home
    for sign in (1.0, -1.0):
        fast = (here[0] + sign * 0.002 * ROBOT.velocity[0] * 1.01, *here[1:])
        assert not bounds.allow(here, fast)
        near = (sign * (ROBOT.position_max[0] - 1e-3), *here[1:])
        assert not bounds.allow(near, (near[0] + sign * 0.9e-3, *here[1:]))
        assert bounds.allow(near, (near[0] - sign * 3e-3, *here[1:])), "away from the limit at full speed"
