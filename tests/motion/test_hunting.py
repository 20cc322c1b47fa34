"""Limits at every tick, and everywhere in every plan, whatever is sent and whenever."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.motion.lookahead import LookAhead
from tests.hunting import Hunt
from tests.wide_hunting import WideHunt

FOUND = (476, 291, 112, 131, 179, 508, 1119, 2125, 10290, 10727, 10756, 31510)
"""Seeds at which a limit was passed."""
FOUND_WIDELY = (100040, 100317, 100343, 100561, 501314, 200462, 700510)
"""Seeds at which a `WideHunt` found a fault."""


def moves(seed: int) -> dict[str, float]:
    """Hunt by a seed."""
    return Hunt(seed).check()


def all_modes(seed: int) -> dict[str, float]:
    """A random program of commands in any mode, with all that always holds checked in each tick."""
    return WideHunt(seed).check()


@pytest.mark.slow
@pytest.mark.requirement("FRC003", "FRC013", "FRC014", "FRC016", "FRC025")
@pytest.mark.parametrize("seed", FOUND)
def test_what_was_found_by_hunting_keeps_all_limits(seed: int) -> None:
    moves(seed)


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.requirement("FRC003", "FRC013", "FRC014", "FRC016", "FRC025")
@pytest.mark.parametrize("seed", FOUND_WIDELY)
def test_what_was_found_by_hunting_widely_keeps_all_limits(seed: int) -> None:
    all_modes(seed)


@pytest.mark.slow
@pytest.mark.requirement("FRC003", "FRC013", "FRC014", "FRC016", "FRC025")
@given(st.integers(0, 2**32 - 1))
def test_whatever_is_sent_keeps_all_limits(seed: int) -> None:
    moves(seed)


@pytest.mark.requirement("FRC003", "FRC005", "FRC012", "FRC013", "FRC014", "FRC015", "FRC016", "FRC025")
@given(st.integers(0, 2**32 - 1))
def test_whatever_is_sent_in_any_mode_keeps_all_limits_paths_and_spheres(seed: int) -> None:
    all_modes(seed)
