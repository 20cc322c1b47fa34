"""Kernels of chains: what they find is exact, also for numbers at the edges."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from iiwa_sim.motion.path.piecewise_kernel import Polynomial
from iiwa_sim.motion.queue import motion_kernel, rows_kernel, straight_kernel
from iiwa_sim.motion.queue.chain_kernel import JointPath
from iiwa_sim.motion.queue.planning import MANY_CELLS
from iiwa_sim.motion.timing import run_kernel

JOINTS = 3
UNIT_S = 0.01


def a_path() -> JointPath:
    """Three moves round two corners: a straight one, one of one piece, and one of two."""
    rng = np.random.default_rng(1)
    rows = [2, 9, 6, 6]
    coefficients = (
        rng.normal(size=(sum(rows), JOINTS)) * 0.3 ** np.concatenate([np.arange(n) for n in rows])[:, None]
    )
    limits = rng.uniform(1.0, 2.0, (3, 3, JOINTS)) * np.array([2.0, 10.0, 250.0])[:, None]
    start, end = (0.0,) * JOINTS, (1.0,) * JOINTS
    pieces = np.split(coefficients, np.cumsum(rows)[:-1])
    return JointPath(
        np.array([0.1, 0.4, 0.9, 1.2]),
        np.array([0.0, *rng.uniform(0.05, 0.49, 2), 0.0]),
        np.array([0.0, *rng.uniform(0.05, 0.49, 2), 0.0]),
        np.array([1.0, *rng.uniform(0.1, 1.0, 2), 1.0]),
        [
            Polynomial([0.0, 1.0], pieces[:1], start, end),
            Polynomial([0.0, 1.0], pieces[1:2], start, end),
            Polynomial([0.0, 0.4, 1.0], pieces[2:], start, end),
        ],
        limits,
    )


@given(
    ways=st.floats(-6.0, 1.0), velocities=st.floats(-4.0, 1.0), acceleration=st.floats(0.1, 10.0),
    building_s=st.floats(0.02, 0.2),
)  # fmt: skip
def test_the_same_motion_evenly_keeps_its_limits_and_is_nearly_as_fast(
    ways: float, velocities: float, acceleration: float, building_s: float
) -> None:
    way, velocity, jerk = 10.0**ways, 10.0**velocities, acceleration / building_s
    times, jerks = np.empty(7), np.empty(7)
    end_s = run_kernel.rest_to_rest(way, velocity, acceleration, jerk, times, jerks)
    evenly = straight_kernel.Evenly(way, velocity, acceleration, jerk, times[0], times[1])
    assume(evenly.cells(end_s) <= MANY_CELLS)
    x, clock = evenly.found(end_s, UNIT_S)
    cells_s = UNIT_S / np.sqrt(clock[0])
    assert (clock == clock[0]).all()
    assert (x[:3] == 0.0).all()
    assert (x[-3:] == way).all()
    assert (np.diff(x) >= 0.0).all()
    assert 0.5 * (x[2:] - x[:-2]).max() / cells_s <= velocity * (1.0 + 1e-9)
    assert np.abs(np.diff(x, 2)).max() / cells_s**2 <= acceleration * (1.0 + 1e-9)
    assert np.abs(np.diff(x, 3)).max() / cells_s**3 <= jerk * (1.0 + 1e-9)
    assert 1.0 - 1e-9 <= cells_s * (len(x) - 3) / end_s <= 1.005


PLACES, WEIGHTS = np.polynomial.legendre.leggauss(400)


@given(exponents=st.lists(st.floats(-4.0, 1.0), min_size=3, max_size=3))
def test_the_time_of_a_cell_is_exact_also_where_the_clock_comes_near_to_0(exponents: list[float]) -> None:
    c = 10.0 ** np.array(exponents)
    u = 0.5 * (PLACES + 1.0)
    b = 0.5 * (c[0] + c[1]) + u * (c[1] - c[0]) + 0.5 * u * u * (c[0] - 2.0 * c[1] + c[2])
    times = np.zeros(2)
    motion_kernel.add_times(c, times)
    assert np.isclose(times[1], 0.5 * float((WEIGHTS / np.sqrt(b)).sum()), rtol=1e-10)


def test_cells_that_run_backwards_or_are_no_numbers_have_places_in_order() -> None:
    """Places that are counted below 0 would be written before the arrays that they are in."""
    way = a_path()
    for controls in (np.linspace(2.9, -40.0, 30), np.full(30, np.nan), np.geomspace(1.0, 1e300, 30)):
        starts = np.zeros(28, dtype=np.intp)
        places = rows_kernel.layout(way, controls, 0, starts)
        assert places == starts[-1]
        assert (np.diff(starts) >= 2).all()
        assert (np.diff(starts) <= 40).all()
