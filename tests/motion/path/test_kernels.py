"""The kernels of paths compiled and as Python runs their text: the same to the last bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.frames import IDENTITY, Transform, multiply, rotation_about
from iiwa_sim.motion.path import (
    extremes_kernel,
    line_kernel,
    piecewise_kernel,
    tcp_line_kernel,
    zone_kernel,
)
from tests.interpreted import interpreted
from tests.robot.arms import BUILT_IN, arm_named
from tests.samples import some

PLAIN_EXTREMES = interpreted("iiwa_sim.motion.path.extremes_kernel")
PLAIN_LINE = interpreted("iiwa_sim.motion.path.line_kernel")
PLAIN_TCP_LINE = interpreted("iiwa_sim.motion.path.tcp_line_kernel")
PLAIN_PIECEWISE = interpreted("iiwa_sim.motion.path.piecewise_kernel")
PLAIN_ZONE = interpreted("iiwa_sim.motion.path.zone_kernel")
SEEDS = st.integers(0, 2**32 - 1)


@pytest.mark.parametrize("name", BUILT_IN)
@settings(max_examples=5, deadline=None)
@given(seed=SEEDS, far_m=st.sampled_from([0.1, 0.8]))
def test_fits_of_lines(name: str, seed: int, far_m: float) -> None:
    arm = arm_named(name)
    inverse, home = arm.inverse, arm.description.home
    start, status, rng = arm.model.flange(home), inverse.status(home), np.random.default_rng(seed)
    (x, y, z), (dx, dy, dz) = start.translation, rng.uniform(-far_m, far_m, 3).tolist()
    end = Transform(multiply(rotation_about((0.6, 0.0, 0.8), 0.3), start.rotation), (x + dx, y + dy, z + dz))
    tool = Transform(rotation_about((0.0, 0.6, 0.8), 0.7), (0.05, -0.02, 0.1))
    found = []
    for of_line, of_joints in ((tcp_line_kernel, line_kernel), (PLAIN_TCP_LINE, PLAIN_LINE)):
        line = of_line.TcpLine(start, end, tool)
        along = of_joints.LineJoints(inverse, home, line, inverse.redundancy(home) + 0.1)
        fitted = along.pieces(0.0, 1.0, status, home, home, 1.0 / 128.0, near=False)
        pieces = fitted if isinstance(fitted, float) else (fitted[0], [piece.tolist() for piece in fitted[1]])
        place = along.at(0.3, status, home)
        meeting = along.meeting(status, status ^ 1, home, 0.0, 0.3, home, place or home)
        found.append((line.length_m, line.flange(0.3), pieces, place, meeting))
    assert found[0] == found[1]


@settings(max_examples=some(20), deadline=None)
@given(seed=SEEDS, rows=st.lists(st.integers(2, 12), min_size=1, max_size=3), s=st.floats(-0.1, 1.1))
def test_curves_of_pieces(seed: int, rows: list[int], s: float) -> None:
    rng = np.random.default_rng(seed)
    pieces = [rng.normal(size=(count, 3)) for count in rows]
    borders = np.linspace(0.0, 1.0, len(rows) + 1).tolist()
    found = []
    both = (piecewise_kernel, extremes_kernel), (PLAIN_PIECEWISE, PLAIN_EXTREMES)
    for piecewise, extremes in both:
        path = piecewise.Polynomial(borders, pieces, (0.0, 0.0, 0.0), (1.0, 2.0, 3.0))
        limits = np.full(3, -2.0), np.full(3, 2.0)
        outside = extremes.first_outside(path, *limits)
        least = extremes.least_time_s(path, np.array([1.0, 0.5, 2.0]))
        found.append(
            (
                path.joints(s),
                path.derivatives(np.array([s, 0.5])).tolist(),
                extremes.travel(path).tolist(),
                least,
                outside and tuple(outside),
            )
        )
    assert found[0] == found[1]


@pytest.mark.parametrize("of_tcp", [True, False])
@settings(max_examples=some(10), deadline=None)
@given(seed=SEEDS, radius=st.floats(0.01, 1.0), at_end=st.booleans())
def test_zones(of_tcp: bool, seed: int, radius: float, at_end: bool) -> None:
    arm = arm_named(BUILT_IN[0])
    start, way = arm.anywhere(np.random.default_rng(seed), 2)
    other = tuple((start - 0.3 * way).tolist()), tuple((start + 0.3 * way).tolist())
    target = other[1] if at_end else other[0]
    parts = []
    for zones, paths in ((zone_kernel, piecewise_kernel), (PLAIN_ZONE, PLAIN_PIECEWISE)):
        path = paths.Polynomial([0.0, 1.0], [np.array([start, 0.3 * way])], *other)
        zone = (
            zones.sphere(radius, target, arm.model.tcp(IDENTITY))
            if of_tcp
            else zones.joint_ball(radius, *other)
        )
        parts.append((zone.part_inside(path, at_end=at_end), zone.clipped(path, path).radius))
    assert parts[0] == parts[1]
