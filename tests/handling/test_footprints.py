"""Footprints of level parts, and where one presses over another."""

from __future__ import annotations

from math import cos, hypot, sin

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.interpreted import interpreted
from tests.samples import some

PLAIN = interpreted("iiwa_sim.handling.over_kernel")
TOUCHES_M, ROUNDING_M = 1e-9, 1e-14
size = st.floats(0.002, 0.05)
angle = st.floats(-3.0, 3.0)


@st.composite
def footprint(draw: st.DrawFn) -> np.ndarray:
    """A rectangle, or a disc, somewhere near the origin, 0.3 m high."""
    turn = draw(angle)
    half_width = draw(st.one_of(size, st.just(-1.0)))
    x, y = draw(st.floats(-0.08, 0.08)), draw(st.floats(-0.08, 0.08))
    return np.array([draw(size), half_width, x, y, cos(turn), sin(turn), 0.3])


def points(face: np.ndarray) -> list[tuple[float, float]]:
    """Corners of a rectangle, or points of the rim of a disc (m)."""
    a, b, x, y, c, s, _ = face.tolist()
    if b < 0.0:
        return [(x + a * cos(at), y + a * sin(at)) for at in np.linspace(0.0, 6.0, 8)]
    corners = [(a, b), (-a, b), (-a, -b), (a, -b)]
    return [(x + u * c - v * s, y + u * s + v * c) for u, v in corners]


def off(face: np.ndarray, x: float, y: float) -> float:
    """How far (m) a place is beside a footprint."""
    u, v = PLAIN.into(face, 0.0, x, y)
    return hypot(u - x, v - y)


@settings(max_examples=some(200), deadline=None)
@given(footprint(), footprint())
def test_a_point_presses_within_both_outlines_or_not_at_all(under: np.ndarray, face: np.ndarray) -> None:
    for x, y in points(under):
        is_over, px, py = PLAIN.over(under, face, x, y)
        if is_over:
            assert off(face, px, py) < ROUNDING_M
            assert off(under, px, py) <= 1.001 * TOUCHES_M


@settings(max_examples=some(200), deadline=None)
@given(footprint(), footprint())
def test_outlines_that_are_apart_have_no_such_place(under: np.ndarray, face: np.ndarray) -> None:
    """So nobody looks for one there; others are in each other, or nearer to that than they are large."""
    apart_m = PLAIN.beside(under, face)
    assert abs(apart_m - PLAIN.beside(face, under)) < ROUNDING_M
    if apart_m > TOUCHES_M:
        assert not any(PLAIN.over(under, face, x, y)[0] for x, y in points(under))
    nearest_m = min(off(face, x, y) for x, y in points(under))
    assert apart_m <= nearest_m + ROUNDING_M
