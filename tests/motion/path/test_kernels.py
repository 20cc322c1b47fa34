"""The kernels of paths compiled and as Python runs their text: the same to the last bit."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.frames import IDENTITY, Transform
from iiwa_sim.motion.path import line_kernel, polynomial_kernel, zone_kernel
from iiwa_sim.motion.tcp_line import TcpLine
from tests.interpreted import interpreted
from tests.robot.arms import BUILT_IN, arm_named
from tests.samples import some

PLAIN_POLYNOMIAL = interpreted("iiwa_sim.motion.path.polynomial_kernel")
PLAIN_LINE = interpreted("iiwa_sim.motion.path.line_kernel")
PLAIN_ZONE = interpreted("iiwa_sim.motion.path.zone_kernel")
SEEDS = st.integers(0, 2**32 - 1)


@settings(max_examples=some(30), deadline=None)
@given(seed=SEEDS, rows=st.lists(st.integers(1, 20), min_size=1, max_size=3), orders=st.integers(0, 3))
def test_polynomials(seed: int, rows: list[int], orders: int) -> None:
    rng = np.random.default_rng(seed)
    borders = np.linspace(0.0, 1.0, len(rows) + 1)
    offsets = np.cumsum([0, *rows])
    coefficients, s = rng.normal(size=(sum(rows), 3)), rng.uniform(0.0, 1.0, 4)
    found = np.empty((2, orders + 1, 4, 3))
    polynomial_kernel.derivatives(borders, offsets, coefficients, s, found[0])
    PLAIN_POLYNOMIAL.derivatives(borders, offsets, coefficients, s, found[1])
    assert (found[0] == found[1]).all()


@pytest.mark.parametrize("name", BUILT_IN)
@settings(max_examples=5, deadline=None)
@given(seed=SEEDS)
def test_fits_of_lines(name: str, seed: int) -> None:
    arm = arm_named(name)
    inverse, home = arm.inverse, np.array(arm.description.home)
    start = arm.model.flange(home.tolist())
    shift = np.random.default_rng(seed).uniform(-0.1, 0.1, 3)
    end = Transform(start.rotation, tuple((np.array(start.translation) + shift).tolist()))
    arguments = (
        inverse.kind, inverse.numbers, TcpLine(start, end, IDENTITY).numbers, inverse.redundancy(home), 0.1,
        inverse.status(home.tolist()), home, 1e-8, False, 0.0, 1.0, home,
    )  # fmt: skip
    found = []
    for kernel in (line_kernel, PLAIN_LINE):
        nodes, weights = np.empty(17), np.empty((17, 17))
        kernel.nodes_and_weights(16, nodes, weights)
        coefficients = np.zeros((17, len(home)))
        room = np.empty((17, 12)), np.empty((17, len(home)))
        rows = kernel.fit(*arguments, nodes, weights, *room, coefficients)
        found.append((rows, nodes.tolist(), weights.tolist(), coefficients[: max(rows, 0)].tolist()))
    assert found[0] == found[1]


@pytest.mark.parametrize("of_tcp", [True, False])
@settings(max_examples=some(10), deadline=None)
@given(seed=SEEDS, radius=st.floats(0.01, 1.0), at_end=st.booleans())
def test_zones(of_tcp: bool, seed: int, radius: float, at_end: bool) -> None:
    arm = arm_named(BUILT_IN[0])
    start, way = arm.anywhere(np.random.default_rng(seed), 2)
    path = np.array([0.0, 1.0]), np.array([0, 2]), np.array([start, 0.3 * way])
    ends = start + 0.3 * way if at_end else start - 0.3 * way
    tcp = arm.model.tcp(IDENTITY)
    fixed = tcp.fixed if of_tcp else np.empty((0, 12))
    centre = np.array(tcp.pose(ends.tolist()).translation) if of_tcp else ends
    parts = [
        kernel.part_inside(fixed, centre, radius, *path, at_end, 0.49, np.empty((1, 1, len(start))))
        for kernel in (zone_kernel, PLAIN_ZONE)
    ]
    assert parts[0] == parts[1]
