"""Noise has the levels it was given, and depends on nothing but its seed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from iiwa_sim.contact.noise import Noise

TICKS = 20_000


def drawn(noise: Noise, ticks: int) -> NDArray[np.float64]:
    """(ticks, 13): wrench, then joint torques."""
    rows = []
    for _ in range(ticks):
        rows.append((*noise.wrench, *noise.joint_torques))
        noise.next()
    return np.array(rows)


def test_mean_deviation_and_independence() -> None:
    values = drawn(Noise(11, 0.5, 0.02, 0.1, 7), TICKS)
    sigma = np.repeat([0.5, 0.02, 0.1], [3, 3, 7])
    assert np.abs(values.mean(axis=0) / sigma).max() < 4.5 / np.sqrt(TICKS)
    assert values.std(axis=0) == pytest.approx(sigma, rel=4.5 / np.sqrt(2 * TICKS))
    each_other = np.corrcoef(values.T) - np.eye(13)
    one_tick_later = (values[1:] * values[:-1]).mean(axis=0) / sigma**2
    assert np.abs(each_other).max() < 5.0 / np.sqrt(TICKS)
    assert np.abs(one_tick_later).max() < 5.0 / np.sqrt(TICKS)
    within_one_sigma = (np.abs(values) < sigma).mean()
    assert within_one_sigma == pytest.approx(0.6827, abs=0.005)


def test_the_seed_decides() -> None:
    levels = 1.0, 1.0, 1.0, 7
    assert np.array_equal(drawn(Noise(5, *levels), 1000), drawn(Noise(5, *levels), 1000))
    assert not np.array_equal(drawn(Noise(5, *levels), 10), drawn(Noise(6, *levels), 10))
    noise = Noise(5, *levels)
    first = noise.wrench
    noise.next(12_345)
    assert noise.wrench != first
    noise.seed(5)
    assert noise.wrench == first, "a seed begins anew"
    assert not drawn(Noise(5, 0.0, 1.0, 1.0, 7), 100)[:, :3].any()


@given(st.lists(st.integers(0, 100_000), min_size=1, max_size=8))
def test_ticks_may_be_left_out(gaps: list[int]) -> None:
    skipping = Noise(5, 1.0, 0.1, 1.0, 7)
    for gap in gaps:
        skipping.next(gap)
    ticking = Noise(5, 1.0, 0.1, 1.0, 7)
    ticking.next(max(sum(gaps) - 2, 0))
    for _ in range(min(sum(gaps), 2)):
        ticking.next()
    assert (skipping.wrench, skipping.joint_torques) == (ticking.wrench, ticking.joint_torques)
