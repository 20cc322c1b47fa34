"""Boxes that stand flush, edge on edge or corner on corner: there is no way through."""

from __future__ import annotations

from math import cos, sin

from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.crowd import PressingBall
from iiwa_sim.contact.shapes import Box
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Frame
from tests.contact.floor import TICK_S, Floor
from tests.handling.depths import depth_m
from tests.samples import some

SOFT_M = 1.5e-3
"""So far 0.2 kg at 0.5 m/s press springs in that are met at a few places only."""

half = st.sampled_from((0.003, 0.01, 0.02, 0.035))


@settings(max_examples=some(60), deadline=None)
@given(
    a=st.tuples(half, half),
    b=st.tuples(half, half),
    flush=st.sampled_from((-1, 0, 1, 2)),
    gap=st.sampled_from((0.0, 1e-9, 1e-4, 1e-3)),
    along=st.sampled_from((0.0, 0.1, -0.2)),
    speed=st.floats(0.05, 0.5),
    turned=st.sampled_from((0.0, 0.3, 1.5707963267948966, 2.5)),
    kind=st.sampled_from(("slides", "is pushed", "slides at a wall")),
)
def test_what_is_flush_with_another_does_not_go_through(
    a: tuple[float, float],
    b: tuple[float, float],
    flush: int,
    gap: float,
    along: float,
    speed: float,
    turned: float,
    kind: str,
) -> None:
    """A box comes to another, or to a wall, with an edge, both edges or a corner of each in one line."""
    stands = kind == "slides at a wall"
    # Across its way: left edges, middles, right edges in one line; or its left corner meets the right one.
    y = {-1: b[1] - a[1], 0: 0.0, 1: a[1] - b[1], 2: a[1] + b[1]}[flush]
    x = a[0] + b[0] + gap
    c, s = cos(turned), sin(turned)
    at = Frame(1e3 * (c * x - s * y), 1e3 * (s * x + c * y), 30.0, turned, 0.0, 0.0).to_transform()
    wall = Surface("wall", Box(*b, 0.1), at, 5e4, 0.0, 0.3)
    floor = Floor(*([wall] if stands else []))
    v, w = speed, speed * along
    floor.put(Box(*a, 0.02), 0.0, 0.0, turned, (c * v - s * w, s * v + c * w, 0.0, 0.0))
    if not stands:
        floor.put(Box(*b, 0.02), c * x - s * y, s * x + c * y, turned)
    floor.begin()
    deepest = 0.0
    for tick in range(120):
        far = -0.01 - a[0] + tick * TICK_S * v
        behind = PressingBall((c * far, s * far, 0.02), 0.01, 5e4)
        floor.step(*([(0, behind)] if kind == "is pushed" else []))
        one, other = floor.laid[0].solid, wall if stands else floor.laid[1].solid
        deepest = max(deepest, depth_m(one, other), depth_m(other, one))
    assert deepest < SOFT_M
