"""The jaws of a gripper over time."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.handling.gripper import CLOSES, OPENS, STAYS, Gripper, Jaws

JAWS = Jaws(stroke_m=0.08, speed_m_per_s=0.1, force_n=40.0)
TICK_S = 0.002


def test_it_closes_and_opens_at_its_speed() -> None:
    gripper = Gripper(JAWS)
    assert gripper.is_open
    gripper.step(CLOSES, 0.0, TICK_S)
    assert gripper.opening_m == pytest.approx(0.0798)
    assert (gripper.is_open, gripper.is_closed, gripper.holds) == (False, False, False)
    ticks = 1
    while not gripper.settled(CLOSES):
        gripper.step(CLOSES, 0.0, TICK_S)
        ticks += 1
    assert ticks in (400, 401)  # 0.8 s, and rounding
    assert (gripper.opening_m, gripper.is_closed, gripper.holds) == (0.0, True, False)
    for _ in range(401):
        gripper.step(OPENS, 0.0, TICK_S)
    assert gripper.is_open
    assert gripper.settled(OPENS)
    assert not gripper.settled(CLOSES)


def test_it_stays_where_nothing_drives_it() -> None:
    gripper = Gripper(JAWS)
    for _ in range(50):
        gripper.step(CLOSES, 0.0, TICK_S)
    there = gripper.opening_m
    assert not gripper.settled(STAYS)
    gripper.step(STAYS, 0.0, TICK_S)
    assert gripper.settled(STAYS)
    assert gripper.opening_m == there


def test_what_is_between_the_jaws_stops_them() -> None:
    gripper = Gripper(JAWS)
    while not gripper.settled(CLOSES):
        gripper.step(CLOSES, 0.05, TICK_S)
    assert gripper.opening_m == 0.05
    assert gripper.holds
    assert not gripper.is_closed
    gripper.step(OPENS, 0.05, TICK_S)
    assert not gripper.holds


def test_it_goes_on_holding_while_nothing_drives_it() -> None:
    """A valve with two coils gets a pulse, and stays as it is."""
    gripper = Gripper(JAWS)
    while not gripper.settled(CLOSES):
        gripper.step(CLOSES, 0.05, TICK_S)
    gripper.step(STAYS, 0.05, TICK_S)
    assert gripper.holds
    gripper.step(OPENS, 0.05, TICK_S)
    assert not gripper.holds


def test_stuck_jaws_go_nowhere() -> None:
    gripper = Gripper(JAWS)
    gripper.stuck = True
    gripper.step(CLOSES, 0.0, TICK_S)
    assert gripper.is_open
    assert gripper.settled(CLOSES)
    gripper.stuck = False
    assert not gripper.settled(CLOSES)


def test_stuck_jaws_hold_what_they_hold() -> None:
    gripper = Gripper(JAWS)
    while not gripper.settled(CLOSES):
        gripper.step(CLOSES, 0.05, TICK_S)
    gripper.stuck = True
    gripper.step(OPENS, 0.05, TICK_S)
    assert gripper.holds
    assert gripper.settled(OPENS)
    gripper.stuck = False
    gripper.step(OPENS, 0.05, TICK_S)
    assert not gripper.holds


@given(
    driven=st.lists(st.sampled_from([CLOSES, OPENS, STAYS]), min_size=1, max_size=60),
    widths=st.lists(st.sampled_from([0.0, 0.02, 0.06]), min_size=1, max_size=6),
)
def test_it_never_leaves_its_stroke_nor_jumps(driven: list[int], widths: list[float]) -> None:
    gripper = Gripper(JAWS)
    for tick, towards in enumerate(driven):
        before = gripper.opening_m
        gripper.step(towards, min(widths[tick % len(widths)], before), 0.05)
        assert 0.0 <= gripper.opening_m <= JAWS.stroke_m
        assert abs(gripper.opening_m - before) <= 0.05 * JAWS.speed_m_per_s + 1e-15
        assert gripper.is_open + gripper.is_closed + gripper.holds <= 1
