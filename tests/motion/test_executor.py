"""The executor: moves follow each other without a gap, and a path that fails ends them."""

import numpy as np
import pytest

from iiwa_sim.motion.blend import Move
from iiwa_sim.motion.executor import Executor
from iiwa_sim.motion.limits import STANDSTILL_RAD, JointLimits
from iiwa_sim.motion.path import ptp
from iiwa_sim.motion.plan_kernel import Polynomial
from iiwa_sim.motion.time_scaling import TimeScaling
from iiwa_sim.motion.trajectory import begun

TICK_S = 0.01
LIMITS = JointLimits(np.array([1.0]), np.array([10.0]), np.array([100.0]))


def broken() -> Polynomial:
    """A path without joint positions between its ends."""
    return Polynomial((0.0, 1.0), [np.full((3, 1), np.nan)], (0.0,), (1.0,))


def executor() -> Executor:
    return Executor((0.0,), TimeScaling(TICK_S, 15.0, 600.0), np.array([-10.0]), np.array([10.0]))


def move(number: int, path: Polynomial) -> Move:
    """At full speed, to a stop."""
    way = abs(path.end[0] - path.joints(0.0)[0])
    length_s = way if way > STANDSTILL_RAD else 0.0
    return Move(number, path, LIMITS, length_s, None, lambda _: None)


def steps(d: Executor, ticks: int) -> None:
    for _ in range(ticks):
        d.step()


def test_a_move_starts_within_the_tick_in_which_the_one_before_ends() -> None:
    d = executor()
    alone = begun(move(1, ptp((0.0,), (1.073,))))
    assert (2.0 * alone.end_s) % TICK_S > 1e-3
    d.append(move(1, ptp((0.0,), (1.073,))))
    d.append(move(2, ptp((1.073,), (2.146,))))
    ticks = 0
    while d.moving:
        d.step()
        ticks += 1
    assert d.joints == (2.146,)
    assert ticks == int(np.ceil(2.0 * alone.end_s / TICK_S))


def test_where_a_path_fails_the_robot_rests_and_takes_new_moves() -> None:
    d = executor()
    d.append(move(1, broken()))
    d.append(move(2, ptp((1.0,), (2.0,))))
    with pytest.raises(ArithmeticError):
        steps(d, 1000)
    assert not d.moving
    assert d.waiting == 0
    assert d.rest == d.joints
    assert 0.0 <= d.joints[0] <= 0.5
    d.append(move(3, ptp(d.rest, (0.0,))))
    while d.moving:
        d.step()
    assert d.joints == (0.0,)


def test_moves_of_hardly_any_way_take_a_tick_each() -> None:
    d = executor()
    for k in range(10):
        d.append(move(k + 1, ptp((1e-9 * k,), (1e-9 * (k + 1),))))
    passed = [d.joints[0]]
    while d.moving:
        d.step()
        passed.append(d.joints[0])
    np.testing.assert_allclose(np.diff(passed), 1e-9)
