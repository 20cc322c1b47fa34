"""Joint trajectories: the curve through their points, its extremes, and its averages."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from iiwa_sim.motion.joint_trajectory import JointTrajectory, Knot, Reference, Windows, averaged

Array = NDArray[np.float64]

JOINTS = 3
SEEDS = st.integers(0, 2**32 - 1)
widths = st.sampled_from([0.0, 0.01, 0.2, 1.5])


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
    found = [averaged(reference.times, reference.pieces, (), times, order) for order in range(3)]
    values = np.stack(found, axis=1)
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
    values = averaged(reference.times, reference.pieces, (), times, order)
    lowest, highest = values.min(axis=0), values.max(axis=0)
    slack = 1e-9 + 1e-3 * (highest - lowest)
    assert reference.first_beyond(order, lowest - 20.0 * slack, highest + 20.0 * slack) is None
    shrunk = 0.9 * highest + 0.1 * lowest
    outside = (values > shrunk + 1e-9).any(axis=1)
    beyond = reference.first_beyond(order, lowest - 20.0 * slack, shrunk)
    if outside.any():
        assert beyond is not None
        assert beyond.time_s <= max(times[outside.argmax()], 0.0) + 1e-6


def random_reference(seed: int, count: int) -> Reference:
    random = np.random.default_rng(seed)
    times = np.cumsum(random.uniform(0.05, 0.6, count)) - 0.05
    times[0] = 0.0
    rows = random.uniform(-1.0, 1.0, (count, 3, 2)).tolist()
    told = int(random.integers(1, 4))
    return Reference([Knot(float(t), *map(tuple, row[:told])) for t, row in zip(times, rows, strict=True)])


@given(seed=SEEDS, count=st.integers(2, 6), first=widths, second=widths, part=st.floats(0.0, 1.0))
def test_it_is_the_mean_of_the_mean(seed: int, count: int, first: float, second: float, part: float) -> None:
    reference = random_reference(seed, count)
    smoothed = JointTrajectory(reference, Windows(first, second))
    time = part * smoothed.end_s
    u = (np.arange(60) + 0.5) / 60

    def mean(t: float) -> NDArray[np.float64]:
        times = np.sort(np.clip(t - second * u, reference.times[0], np.nextafter(reference.end_s, 0.0)))
        values: NDArray[np.float64] = averaged(reference.times, reference.pieces, (), times, 0).mean(axis=0)
        return values

    expected = np.mean([mean(time - first * each) for each in u], axis=0)
    assert np.abs(np.array(smoothed.joints(time)) - expected).max() < 0.04


@given(seed=SEEDS, first=widths, second=widths, part=st.floats(0.01, 0.99))
def test_its_derivatives_are_derivatives(seed: int, first: float, second: float, part: float) -> None:
    smoothed = JointTrajectory(random_reference(seed, 5), Windows(first, second))
    time, step = part * smoothed.end_s, 1e-4
    before, here, after = (np.array(smoothed.state(time + k * step)) for k in (-1, 0, 1))
    assert np.abs(here[0] - smoothed.joints(time)).max() == 0.0
    if first and second:  # else there are corners
        assert np.abs((after[0] - before[0]) / (2 * step) - here[1]).max() < 20.0 * step / min(first, second)
        assert np.abs((after[1] - before[1]) / (2 * step) - here[2]).max() < 20.0 * step / (first * second)


def test_it_begins_and_ends_with_the_reference() -> None:
    reference = random_reference(1, 4)
    smoothed = JointTrajectory(reference, Windows(0.2, 0.1))
    assert smoothed.joints(0.0) == pytest.approx(reference.start, abs=1e-15)
    assert smoothed.joints(smoothed.end_s) == reference.end
    assert smoothed.joints(smoothed.end_s - 1e-6) == pytest.approx(reference.end, abs=1e-9)
