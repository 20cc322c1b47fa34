"""The drive: moves follow each other without a gap, and a path that fails ends them."""

import numpy as np
import pytest
from numpy.typing import NDArray

from iiwa_sim.motion.drive import Drive
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.path import Joints
from iiwa_sim.motion.ptp import JointLine
from iiwa_sim.motion.rate import PlannedTime
from iiwa_sim.motion.timing import AtOnce, OptimalTiming

TICK_S = 0.01


def optimal() -> OptimalTiming:
    return OptimalTiming(1.0, 10.0, 100.0)


class Broken:
    """A path that fails half-way."""

    end: Joints = (1.0,)

    def joints(self, s: float) -> Joints:
        if s > 0.5:
            raise ArithmeticError("no joints")
        return (s,)

    def joints_along(self, s: NDArray[np.float64]) -> list[Joints]:
        return [self.joints(x) for x in s.tolist()]


def drive() -> Drive:
    return Drive((0.0,), PlannedTime(TICK_S, 15.0, 600.0))


def steps(d: Drive, ticks: int) -> None:
    for _ in range(ticks):
        d.step()


def test_a_move_starts_within_the_tick_in_which_the_one_before_ends() -> None:
    d = drive()
    timing = OptimalTiming(0.97, 10.0, 100.0)
    assert (2.0 * timing.duration_s) % TICK_S > 1e-3
    d.append(Move(1, JointLine((0.0,), (1.0,)), lambda: timing))
    d.append(Move(2, JointLine((1.0,), (2.0,)), lambda: timing))
    ticks = 0
    while d.moving:
        d.step()
        ticks += 1
    assert d.joints == (2.0,)
    assert ticks == int(np.ceil(2.0 * timing.duration_s / TICK_S))


def test_where_a_path_fails_the_robot_rests_and_takes_new_moves() -> None:
    d = drive()
    d.append(Move(1, Broken(), optimal))
    d.append(Move(2, JointLine((1.0,), (2.0,)), optimal))
    with pytest.raises(ArithmeticError):
        steps(d, 1000)
    assert not d.moving
    assert d.waiting == 0
    assert d.rest == d.joints
    assert 0.0 <= d.joints[0] <= 0.5
    d.append(Move(3, JointLine(d.rest, (0.0,)), optimal))
    while d.moving:
        d.step()
    assert d.joints == (0.0,)


def test_moves_of_hardly_any_way_take_a_tick_each() -> None:
    d = drive()
    for k in range(10):
        d.append(Move(k + 1, JointLine((1e-9 * k,), (1e-9 * (k + 1),)), AtOnce))
    passed = [d.joints[0]]
    while d.moving:
        d.step()
        passed.append(d.joints[0])
    np.testing.assert_allclose(np.diff(passed), 1e-9)
