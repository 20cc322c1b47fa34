"""The curve through the points of a trajectory: what joint_trajectory_controller draws, and its extremes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from iiwa_sim.motion.trajectory.reference import Knot, Reference

Array = NDArray[np.float64]

JOINTS = 3
SEEDS = st.integers(0, 2**32 - 1)


def random_knots(seed: int, count: int, kind: str) -> list[Knot]:
    """Knots with positions, or also with velocities, or also with accelerations."""
    random = np.random.default_rng(seed)
    times = np.cumsum(random.uniform(0.05, 1.0, count)) - 0.5
    rows = random.uniform(-1.0, 1.0, (count, 3, JOINTS)).tolist()
    told = {"line": 1, "cubic": 2, "quintic": 3}[kind]
    return [Knot(float(t), *map(tuple, row[:told])) for t, row in zip(times, rows, strict=True)]


@pytest.mark.parametrize("kind", ["line", "cubic", "quintic"])
@given(seed=SEEDS, count=st.integers(2, 8))
def test_the_curve_passes_its_points_as_they_are_told(kind: str, seed: int, count: int) -> None:
    knots = random_knots(seed, count, kind)
    reference = Reference(knots)
    for before, after in pairwise(knots):
        for knot, time in ((before, before.time_s), (after, after.time_s - 1e-13)):
            told = [each for each in knot[1:] if each is not None]
            found = reference.at(time)[: len(told)]
            assert np.abs(np.subtract(found, told)).max() < 1e-6
    assert reference.at(knots[-1].time_s) == (knots[-1].positions, (0.0,) * JOINTS, (0.0,) * JOINTS)
    assert reference.at(knots[0].time_s - 1.0)[0] == knots[0].positions


@given(seed=SEEDS, order=st.integers(0, 3), kind=st.sampled_from(["line", "cubic", "quintic"]))
def test_the_derivatives_are_derivatives_and_lie_in_their_ranges(seed: int, order: int, kind: str) -> None:
    knots = random_knots(seed, 4, kind)
    reference = Reference(knots)
    times = np.linspace(knots[0].time_s, knots[-1].time_s - 1e-9, 400)
    values = np.array([reference.at(float(t)) for t in times])
    step = times[1] - times[0]
    inside = np.array([not any(t <= knot.time_s <= t + step for knot in knots) for t in times[:-1]])
    by_differences = (np.diff(values[:, 0], axis=0) / step)[inside]
    middle = (0.5 * (values[1:, 1] + values[:-1, 1]))[inside]
    assert np.abs(by_differences - middle).max() < 1e3 * step**2 * 100
    if 1 <= order <= 2:
        bounds = reference.range(order)
        assert (values[:, order] <= bounds.highest + 1e-9).all()
        assert (values[:, order] >= bounds.lowest - 1e-9).all()


@given(seed=SEEDS, order=st.integers(0, 2), kind=st.sampled_from(["line", "cubic", "quintic"]))
def test_what_leaves_its_bounds_is_found_where_it_first_does(seed: int, order: int, kind: str) -> None:
    knots = random_knots(seed, 5, kind)
    reference = Reference(knots)
    times = np.linspace(knots[0].time_s, knots[-1].time_s - 1e-9, 2000)
    values = np.array([reference.at(float(t))[order] for t in times])
    lowest, highest = values.min(axis=0), values.max(axis=0)
    slack = 1e-9 + 1e-3 * (highest - lowest)
    assert reference.first_beyond(order, lowest - 20.0 * slack, highest + 20.0 * slack) is None
    shrunk = 0.9 * highest + 0.1 * lowest
    outside = (values > shrunk + 1e-9).any(axis=1)
    beyond = reference.first_beyond(order, lowest - 20.0 * slack, shrunk)
    if outside.any():
        assert beyond is not None
        assert beyond.s <= max(times[outside.argmax()], 0.0) + 1e-6
