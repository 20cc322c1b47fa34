"""Whatever is asked of joints, tick by tick: they stay within their limits, and can brake at any tick."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.motion.braking import Braking
from iiwa_sim.motion.joint_bounds import JointBounds, braking_way
from iiwa_sim.robot.description import load_robot

ROBOT = load_robot()
STOP = ROBOT.stop_acceleration, ROBOT.stop_jerk


@settings(max_examples=30, deadline=None)
@given(
    tick_s=st.sampled_from([0.001, 0.002, 0.01]),
    start=st.tuples(
        *[st.floats(low, high) for low, high in zip(ROBOT.position_min, ROBOT.position_max, strict=True)]
    ),
    wanted=st.lists(st.tuples(*[st.floats(-0.2, 0.2)] * 7), min_size=1, max_size=6),
)
def test_who_keeps_the_bounds_keeps_the_limits_also_when_braking(
    tick_s: float, start: tuple[float, ...], wanted: list[tuple[float, ...]]
) -> None:
    low, high = np.array(ROBOT.position_min), np.array(ROBOT.position_max)
    bounds = JointBounds(tick_s, ROBOT.position_min, ROBOT.position_max, ROBOT.velocity, *STOP)
    joints, way = start, np.zeros(7)
    for step in wanted:
        for _ in range(40):
            least, greatest = bounds.ways(joints)
            way = np.clip(step, least, greatest)
            after = tuple((np.array(joints) + way).tolist())
            a_hair_less = np.sign(way) * np.maximum(np.abs(way) - 1e-12, 0.0)
            assert bounds.allow(joints, tuple((np.array(joints) + a_hair_less).tolist()))
            joints = after
            assert (low - 1e-12 <= joints).all()
            assert (joints <= high + 1e-12).all()
            assert (np.abs(way) <= np.array(ROBOT.velocity) * tick_s * (1 + 1e-12)).all()
            # What braking from here would need, before any clipping.
            for q, w, a, j, lower, upper in zip(joints, way, *STOP, low, high, strict=True):
                room = upper - q if w > 0 else q - lower
                assert braking_way(abs(w) / tick_s, a, j) <= room + 1e-9
    velocity = (way / tick_s).tolist()
    braking = Braking(bounds, tick_s, *STOP)
    rest = braking.rest(joints, velocity)
    braking.start(joints, velocity)
    last = np.array(joints)
    ticks = 0
    while braking.active:
        place = np.array(braking.step())
        assert (np.abs(place - last) <= np.abs(way) + 1e-12).all(), "never faster"
        last, ticks = place, ticks + 1
    assert tuple(last.tolist()) == rest
    assert ticks * tick_s <= 0.072 + tick_s


def test_beyond_the_bounds_is_not_allowed() -> None:
    bounds = JointBounds(0.002, ROBOT.position_min, ROBOT.position_max, ROBOT.velocity, *STOP)
    here = ROBOT.home
    for sign in (1.0, -1.0):
        fast = (here[0] + sign * 0.002 * ROBOT.velocity[0] * 1.01, *here[1:])
        assert not bounds.allow(here, fast)
        near = (sign * (ROBOT.position_max[0] - 1e-3), *here[1:])
        assert not bounds.allow(near, (near[0] + sign * 0.9e-3, *here[1:]))
        assert bounds.allow(near, (near[0] - sign * 3e-3, *here[1:])), "away from the limit at full speed"
