"""The drive: moves follow each other without a gap, and a path that fails ends them."""

import numpy as np
import pytest
from numpy.typing import NDArray

from iiwa_sim.motion.chain import Chain, Way
from iiwa_sim.motion.drive import Drive
from iiwa_sim.motion.limits import STANDSTILL_RAD, JointLimits
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.override import Override
from iiwa_sim.motion.ptp import JointLine
from iiwa_sim.motion.rate import PlannedTime
from iiwa_sim.motion.sampled_path import Joints, Path
from iiwa_sim.motion.slices import at_once

TICK_S = 0.01
LIMITS = JointLimits(np.array([1.0]), np.array([10.0]), np.array([100.0]))


class Broken:
    """A path that fails half-way."""

    end: Joints = (1.0,)
    tcp_length_m = None
    samples = JointLine((0.0,), (1.0,)).samples

    def joints(self, s: float) -> Joints:
        if s > 0.5:
            raise ArithmeticError("no joints")
        return (s,)

    def joints_along(self, s: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.array([self.joints(x) for x in s.tolist()])


def drive() -> Drive:
    time = PlannedTime(Override(TICK_S, LIMITS), 15.0, 600.0)
    return Drive((0.0,), time, np.array([-10.0]), np.array([10.0]))


def move(number: int, path: Path) -> Move:
    """At full speed, to a stop."""
    way = abs(path.end[0] - path.joints(0.0)[0])
    length_s = way if way > STANDSTILL_RAD else 0.0
    return Move(number, path, LIMITS, length_s, None, path.joints(0.0), lambda _: None)


def steps(d: Drive, ticks: int) -> None:
    for _ in range(ticks):
        d.step()


def test_a_move_starts_within_the_tick_in_which_the_one_before_ends() -> None:
    d = drive()
    alone = at_once(Chain.along(Way(move(1, JointLine((0.0,), (1.03,))))))
    assert (2.0 * alone.rest_s) % TICK_S > 1e-3
    d.append(move(1, JointLine((0.0,), (1.03,))))
    d.append(move(2, JointLine((1.03,), (2.06,))))
    ticks = 0
    while d.moving:
        d.step()
        ticks += 1
    assert d.joints == (2.06,)
    assert ticks == int(np.ceil(2.0 * alone.rest_s / TICK_S))


def test_where_a_path_fails_the_robot_rests_and_takes_new_moves() -> None:
    d = drive()
    d.append(move(1, Broken()))
    d.append(move(2, JointLine((1.0,), (2.0,))))
    with pytest.raises(ArithmeticError):
        steps(d, 1000)
    assert not d.moving
    assert d.waiting == 0
    assert d.rest == d.joints
    assert 0.0 <= d.joints[0] <= 0.5
    d.append(move(3, JointLine(d.rest, (0.0,))))
    while d.moving:
        d.step()
    assert d.joints == (0.0,)


def test_moves_of_hardly_any_way_take_a_tick_each() -> None:
    d = drive()
    for k in range(10):
        d.append(move(k + 1, JointLine((1e-9 * k,), (1e-9 * (k + 1),))))
    passed = [d.joints[0]]
    while d.moving:
        d.step()
        passed.append(d.joints[0])
    np.testing.assert_allclose(np.diff(passed), 1e-9)
