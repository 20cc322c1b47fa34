"""Which curves are dashed."""

from __future__ import annotations

import numpy as np

from iiwa_sim.plot.overlaps import dashes

TIMES = np.linspace(0.0, 1.0, 200)
SOLID = "-"


def test_a_curve_on_another_is_dashed_and_one_on_two_shorter() -> None:
    curves = np.stack([TIMES, TIMES + 0.5, TIMES, TIMES], axis=1)
    first, apart, second, third = dashes(curves, 1.0)
    assert (first, apart) == (SOLID, SOLID)
    assert not isinstance(second, str)
    assert not isinstance(third, str)
    assert second[1][0] > third[1][0], "what lies below shows in the gaps"
    assert sum(second[1]) == sum(third[1])


def test_curves_that_cross_or_meet_for_a_while_are_not() -> None:
    assert dashes(np.stack([TIMES, 1.0 - TIMES, 0.5 + 0.0 * TIMES], axis=1), 1.0) == [SOLID] * 3
    meets = np.where(TIMES < 0.4, TIMES, TIMES + 0.2)
    assert dashes(np.stack([TIMES, meets], axis=1), 1.0) == [SOLID] * 2


def test_that_all_are_together_for_a_while_counts_for_nothing() -> None:
    moving = np.where(TIMES > 0.8, TIMES - 0.8, 0.0)
    assert dashes(np.stack([moving, -moving, 2.0 * moving], axis=1), 0.4) == [SOLID] * 3


def test_near_is_measured_by_the_height_of_the_panel() -> None:
    curves = np.stack([TIMES, TIMES + 0.01, TIMES + 1.0], axis=1)
    assert dashes(curves, 1.0) == [SOLID] * 3
    assert dashes(curves, 10.0)[1] != SOLID


def test_nothing_moves() -> None:
    assert dashes(np.zeros((5, 7)), 1.0) == [SOLID] * 7
