"""A smoothed reference: an average of it, exactly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from iiwa_sim.motion.trajectory.reference import Knot, Reference
from iiwa_sim.motion.trajectory.smoothed import Smoothed
from iiwa_sim.motion.trajectory.windows import Windows

SEEDS = st.integers(0, 2**32 - 1)
widths = st.sampled_from([0.0, 0.01, 0.2, 1.5])


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
    smoothed = Smoothed(reference, Windows(first, second))
    time = part * smoothed.end_s
    u = (np.arange(60) + 0.5) / 60

    def mean(t: float) -> NDArray[np.float64]:
        values: NDArray[np.float64] = np.mean([reference.at(t - second * each)[0] for each in u], axis=0)
        return values

    expected = np.mean([mean(time - first * each) for each in u], axis=0)
    assert np.abs(np.array(smoothed.joints(time)) - expected).max() < 0.04


@given(seed=SEEDS, first=widths, second=widths, part=st.floats(0.01, 0.99))
def test_its_derivatives_are_derivatives(seed: int, first: float, second: float, part: float) -> None:
    smoothed = Smoothed(random_reference(seed, 5), Windows(first, second))
    time, step = part * smoothed.end_s, 1e-4
    before, here, after = (np.array(smoothed.state(time + k * step)) for k in (-1, 0, 1))
    assert np.abs(here[0] - smoothed.joints(time)).max() == 0.0
    if first and second:  # else there are corners
        assert np.abs((after[0] - before[0]) / (2 * step) - here[1]).max() < 20.0 * step / min(first, second)
        assert np.abs((after[1] - before[1]) / (2 * step) - here[2]).max() < 20.0 * step / (first * second)


def test_it_begins_and_ends_with_the_reference() -> None:
    reference = random_reference(1, 4)
    smoothed = Smoothed(reference, Windows(0.2, 0.1))
    assert smoothed.joints(0.0) == pytest.approx(reference.start, abs=1e-15)
    assert smoothed.joints(smoothed.end_s) == reference.end
    assert smoothed.joints(smoothed.end_s - 1e-6) == pytest.approx(reference.end, abs=1e-9)
