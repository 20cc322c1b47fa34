"""Limits at every tick, and everywhere in every plan, whatever is sent and whenever."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.motion.queue.look_ahead import LookAhead
from tests.hunting import Hunt
from tests.samples import some
from tests.wide_hunting import WideHunt

FOUND = {
    476: "1.06 of a jerk at the end of a cell in a corner, where rows stood for its middle",
    291: "1.013 of a jerk between places in a cell",
    112: "1.016 of a jerk in a change of the override: a corner began less than a millisecond before a knot",
    131: "1.023 of a jerk in the last hundredth of a corner",
    179: "1.11 of a jerk in a plan that was never seen at a tick",
    508: "1.09 of a jerk in such a plan, for half a millisecond",
    1119: "1.03 of a jerk in a move of micrometres, which was planned quickly",
    2125: "1.17 of a jerk in a line of a few micrometres that is made of two pieces, in a thousandth of it",
    10290: "1.38 of a jerk where a clock came near to 0 within a cell, whose time was not exact then",
    10727: "1.85 of a jerk in a corner from a third of a second into a move of micrometres",
    10756: "437 of a jerk for less than a tick in such a corner, in a plan",
    31510: "a plan of 40 days for a line of 276 mm, which bends so fast where it begins that it stood there",
}
"""Seeds, and what was found there by hunting."""

FOUND_WIDELY = {
    100040: "x that went back by some micrometres, before a corner in which the robot all but stands still",
    100317: "1.011 of a jerk between places in a cell, where a parabola through them said 1.004",
    100343: "1.52 of a jerk in the first hundredth of a line of micrometres, which turns the wrist",
    100561: "1.014 of a jerk between places of a cell whose clock bends much",
    100628: "1.014 of a jerk at the border of a corner of micrometres",
    501314: "1.0011 of a velocity in a plan that was taken although it was known",
    200462: "1.0016 of a velocity between places of a cell in a corner",
    700510: "1.021 of a jerk where a corner of unequal sides ended, told for a place 0.2 ms before that",
}
"""Seeds, and what was found there by a `WideHunt`."""


def moves(seed: int) -> dict[str, float]:
    """What `tools/hunt.py` tries at more seeds."""
    return Hunt(seed).check()


def all_modes(seed: int) -> dict[str, float]:
    """A random program of commands in any mode, with all that always holds checked in each tick."""
    return WideHunt(seed).check()


@pytest.mark.requirement("FRC003", "FRC013", "FRC014", "FRC016", "FRC025")
@pytest.mark.parametrize("seed", FOUND)
def test_what_was_found_by_hunting_keeps_all_limits(seed: int) -> None:
    moves(seed)


@pytest.mark.parametrize("seed", [14, 19])
def test_what_looks_ahead_only_where_there_is_something_to_do_moves_as_what_always_asks(
    monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    asks_less = Hunt(seed)
    asks_less.run()
    quiet = property(lambda _: 0.0, lambda *_: None)
    monkeypatch.setattr(LookAhead, "quiet_until_s", quiet, raising=False)
    asks_always = Hunt(seed)
    asks_always.run()
    assert asks_less.robot.joints == asks_always.robot.joints


@pytest.mark.requirement("FRC003", "FRC013", "FRC014", "FRC016", "FRC025")
@pytest.mark.parametrize("seed", FOUND_WIDELY)
def test_what_was_found_by_hunting_widely_keeps_all_limits(seed: int) -> None:
    all_modes(seed)


@pytest.mark.requirement("FRC003", "FRC013", "FRC014", "FRC016", "FRC025")
@settings(max_examples=some(12), deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_whatever_is_sent_keeps_all_limits(seed: int) -> None:
    moves(seed)


@pytest.mark.requirement("FRC003", "FRC005", "FRC012", "FRC013", "FRC014", "FRC015", "FRC016", "FRC025")
@settings(max_examples=some(60), deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_whatever_is_sent_in_any_mode_keeps_all_limits_paths_and_spheres(seed: int) -> None:
    all_modes(seed)
