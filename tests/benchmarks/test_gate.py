"""What `make bench` and its gate call missed."""

from __future__ import annotations

import pytest

from benchmarks.bench import GATE_RUNS, held_back
from benchmarks.figures import Figure, Kind

GOOD = Figure("planning", 0.5, "ms", at_most=0.5, kind=Kind.CPU)
SLOW = Figure("planning", 5.0, "ms", at_most=0.5, kind=Kind.CPU)


def test_a_goal_says_of_which_kind_it_is() -> None:
    with pytest.raises(ValueError, match="of which kind"):
        Figure("planning", 0.5, "ms", at_most=0.5)
    assert Figure("planning", 0.5, "ms").held, "without a goal nothing is asked"


def test_a_missed_goal_is_told_and_the_gate_gives_it_a_margin() -> None:
    at_most = Figure("planning", 0.6, "ms", at_most=0.5, kind=Kind.CPU)
    at_least = Figure("stepping", 150.0, "x real time", at_least=200.0, kind=Kind.CPU)
    ratio = Figure("asking", 1.2, "us", 1.0, ratio_at_most=1.1, kind=Kind.RATIO)
    for near in (at_most, at_least, ratio):
        assert (near.gated, near.met, near.held) == (True, False, True)


@pytest.mark.parametrize(
    "far",
    [
        SLOW,
        Figure("stepping", 90.0, "x real time", at_least=200.0, kind=Kind.CPU),
        Figure("asking", 2.5, "us", 1.0, ratio_at_most=1.1, kind=Kind.RATIO),
        Figure("corners", 1.0500001, "x", at_most=1.05, kind=Kind.SIMULATED),
        Figure("planning", 0.6, "ms", at_most=0.5, kind=Kind.CPU, margin=1.1),
    ],
    ids=lambda figure: f"{figure.name}, {figure.kind}",
)
def test_what_is_missed_by_more_than_its_margin_is_not_held(far: Figure) -> None:
    assert not far.held


@pytest.mark.parametrize("kind", [Kind.WALL, Kind.TAIL])
def test_wall_time_and_a_ratio_of_p99_are_told_and_not_held(kind: Kind) -> None:
    figure = Figure("reply", 5.0, "ms", 1.0, ratio_at_most=2.0, kind=kind)
    assert (figure.gated, figure.met, figure.held) == (False, False, True)


def test_a_row_is_missed_when_no_run_of_some_holds_it() -> None:
    runs = iter([[SLOW], [GOOD]])
    assert held_back([SLOW], lambda: next(runs)) == [], "the last run holds it"
    measured = []
    assert held_back([SLOW], lambda: measured.append(1) or [SLOW]) == [SLOW]
    assert len(measured) == GATE_RUNS - 1
    assert held_back([GOOD], lambda: pytest.fail("nothing is to be measured again")) == []
