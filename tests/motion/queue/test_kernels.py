"""The kernels of chains and of timing compiled and as Python runs their text: the same to the last bit."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.path import piecewise_kernel, zone_kernel
from iiwa_sim.motion.queue import (
    chain_kernel,
    corner_kernel,
    front_kernel,
    motion_kernel,
    rows_kernel,
    straight_kernel,
)
from iiwa_sim.motion.queue.planning import MANY_CELLS
from iiwa_sim.motion.timing import (
    bounds_kernel,
    clock_kernel,
    cuts_kernel,
    guess_kernel,
    loads_kernel,
    run_kernel,
    widths_kernel,
)
from tests.interpreted import interpreted
from tests.samples import some

COMPILED = SimpleNamespace(
    piecewise=piecewise_kernel,
    zone=zone_kernel,
    chain=chain_kernel,
    corner=corner_kernel,
    front=front_kernel,
    motion=motion_kernel,
    rows=rows_kernel,
    straight=straight_kernel,
    bounds=bounds_kernel,
    clock=clock_kernel,
    cuts=cuts_kernel,
    guess=guess_kernel,
    loads=loads_kernel,
    run=run_kernel,
    widths=widths_kernel,
)
PLAIN = SimpleNamespace(
    piecewise=interpreted("iiwa_sim.motion.path.piecewise_kernel"),
    zone=interpreted("iiwa_sim.motion.path.zone_kernel"),
    chain=interpreted("iiwa_sim.motion.queue.chain_kernel"),
    corner=interpreted("iiwa_sim.motion.queue.corner_kernel"),
    front=interpreted("iiwa_sim.motion.queue.front_kernel"),
    motion=interpreted("iiwa_sim.motion.queue.motion_kernel"),
    rows=interpreted("iiwa_sim.motion.queue.rows_kernel"),
    straight=interpreted("iiwa_sim.motion.queue.straight_kernel"),
    bounds=interpreted("iiwa_sim.motion.timing.bounds_kernel"),
    clock=interpreted("iiwa_sim.motion.timing.clock_kernel"),
    cuts=interpreted("iiwa_sim.motion.timing.cuts_kernel"),
    guess=interpreted("iiwa_sim.motion.timing.guess_kernel"),
    loads=interpreted("iiwa_sim.motion.timing.loads_kernel"),
    run=interpreted("iiwa_sim.motion.timing.run_kernel"),
    widths=interpreted("iiwa_sim.motion.timing.widths_kernel"),
)
JOINTS = 3
UNIT_S = 0.01
WINDOW_S = 0.04
LONGEST_S = 100.0


def way_of(kernels: SimpleNamespace, seed: int) -> Any:
    """Three moves round two corners: a straight one, one of one piece, and one of two."""
    rng = np.random.default_rng(seed)
    rows = [2, 9, 6, 6]
    coefficients = (
        rng.normal(size=(sum(rows), JOINTS)) * 0.3 ** np.concatenate([np.arange(n) for n in rows])[:, None]
    )
    limits = rng.uniform(1.0, 2.0, (3, 3, JOINTS)) * np.array([2.0, 10.0, 250.0])[:, None]
    start, end = (0.0,) * JOINTS, (1.0,) * JOINTS
    pieces = np.split(coefficients, np.cumsum(rows)[:-1])
    path = kernels.piecewise.Polynomial
    return kernels.chain.JointPath(
        np.array([0.1, 0.4, 0.9, 1.2]),
        np.array([0.0, *rng.uniform(0.05, 0.49, 2), 0.0]),
        np.array([0.0, *rng.uniform(0.05, 0.49, 2), 0.0]),
        np.array([1.0, *rng.uniform(0.1, 1.0, 2), 1.0]),
        [
            path([0.0, 1.0], pieces[:1], start, end),
            path([0.0, 1.0], pieces[1:2], start, end),
            path([0.0, 0.4, 1.0], pieces[2:], start, end),
        ],
        limits,
    )


def run_along(kernels: SimpleNamespace, way: Any) -> tuple[Array, Array, Array, Array]:
    """Its samples and the fastest run, and the widths and the mean of that."""
    samples = way.samples(way.first_x)
    samples = np.append(samples[:-1:3], samples[-1])  # enough of them
    found, limits = np.empty((len(samples), 4, JOINTS)), np.empty((len(samples), 3, JOINTS))
    way.derivatives(samples, found, limits)
    squares, speeds, times = (np.empty(len(samples)) for _ in range(3))
    kernels.run.caps(found, limits, squares)
    kernels.run.run(samples, found, limits, squares, 0.0, 0.0, speeds, times)
    assume(times[-1] < LONGEST_S)  # where joints turn back at once the run all but stands still
    begins, ends = (np.interp(np.array(each), samples, times) for each in ((0.3, 0.8), (0.5, 1.0)))
    events = kernels.widths.switches(times, speeds)
    widths = kernels.widths.widths(times[-1] + WINDOW_S, begins, ends, events, np.array([0.008, 0.009]))
    mean = np.empty((len(widths) + 1, 3))
    kernels.run.moving_average(
        np.append(way.first_x, samples), np.append(0.0, speeds), np.append(-WINDOW_S, times),
        np.empty(len(samples) + 1), WINDOW_S, np.append(0.0, np.cumsum(widths)), mean,
    )  # fmt: skip
    return samples, found, widths, mean[:40]


def rows_of(kernels: SimpleNamespace, way: Any, controls: Array) -> Any:
    cells = len(controls) - 3
    starts = np.zeros(cells + 1, dtype=np.intp)
    kernels.rows.layout(way, controls, 0, starts)
    rows = kernels.bounds.Rows(starts, JOINTS, None)
    kernels.rows.write(way, controls, 0, cells, rows, np.empty((15, JOINTS)))
    return rows


def arrays_of(bounds: Any) -> list[Array]:
    return [np.asarray(getattr(bounds, each)) for each in ("a1", "a2", "cap", "j1", "j2", "j3", "counts")]


def inside_of(rows: Any) -> list[Array]:
    return [
        np.asarray(getattr(rows, each))
        for each in ("inner", "peaks", "starts", "parts", "per_limit", "tight", "cuts")
    ]


def clock_of(kernels: SimpleNamespace, rows: Any, widths: Array) -> list[Array]:
    """Some steps to a clock over these cells, and all that is found on the way."""
    cells = rows.cells
    c = 0.5 * kernels.guess.steady(rows.bounds, widths)
    c[2:] *= 1.5  # which breaks something
    loads, ends = np.empty((cells, 3)), np.empty((cells + 1, 4))
    kernels.loads.inner_loads(rows, c, 0, cells, loads)
    kernels.guess.knot_loads(rows.bounds, c, ends)
    rows.cuts = kernels.cuts.cut(rows, c, loads, 0.5 * loads.max(axis=0) * np.ones((cells, 1)))
    told = []
    for fixed in (0, 2):
        steps = kernels.clock.Steps(rows, fixed)
        steps.begin(c, 0.3, 0.1)
        told.append(steps.go(c, 3, 0.02))
        steps.add(np.asarray(rows.cuts), c, 0.1)
        for begins, ends_at in ((0, cells), (3, cells - 3)):
            steps.go_on(c, begins, ends_at)
            told.append(steps.go(c, 3, 0.02))
    c[4] *= 0.001
    told.append((0, kernels.guess.lifted(c, 2)))
    guess = c[2:].copy()
    kernels.guess.going_on(rows, widths[2:], np.empty((2, cells - 2)), guess)
    return [
        np.array(told),
        c,
        loads,
        ends,
        guess,
        *arrays_of(rows.bounds),
        *inside_of(rows),
    ]


def motion_of(kernels: SimpleNamespace, way: Any, controls: Array, clock: Array) -> list[Array]:
    later = np.zeros(len(clock) - 1)
    kernels.motion.add_times(clock, later)
    times = UNIT_S * later
    motion = kernels.motion.Motion(way, controls, clock, times, UNIT_S)
    at = times[-1] * np.array([-0.1, 0.0, 0.1, 0.11, 0.5, 0.3, 0.99, 1.0, 1.1])
    joints, found = np.empty((len(at), JOINTS)), np.empty((len(at), 4, JOINTS))
    limits = np.empty((len(at), 3, JOINTS))
    motion.joints_along(at, joints)
    motion.along(at, found, limits)
    kept = [
        kernels.front.kept(controls, clock, times, UNIT_S, 0.1 * t, 0.3 * t, 0.2, way.end_x, WINDOW_S)
        for t in at
    ]
    return [times, joints, found, limits, np.array([motion.move_at(t) for t in at]), np.array(kept)]


def all_of(kernels: SimpleNamespace, seed: int) -> list[Array]:
    way = way_of(kernels, seed)
    samples, derivatives, widths, mean = run_along(kernels, way)
    # Some cells of all of it are enough.
    widths = widths[:12].copy()
    steps = np.concatenate([[0.0] * 2, np.sin(np.linspace(0.2, 3.0, len(widths))) ** 2, [0.0] * 1])
    controls = way.first_x + (way.end_x - way.first_x) * np.cumsum(steps) / steps.sum()
    rows = rows_of(kernels, way, controls)
    clock = clock_of(kernels, rows, widths / UNIT_S)
    return [samples, derivatives, widths, mean, *clock, *motion_of(kernels, way, controls, clock[1])]


@settings(max_examples=2, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_chain_and_its_clock(seed: int) -> None:
    for one, other in zip(all_of(COMPILED, seed), all_of(PLAIN, seed), strict=True):
        assert np.array_equal(one, other)


@settings(max_examples=some(30), deadline=None)
@given(
    way=st.floats(1e-6, 10.0), velocity=st.floats(0.01, 10.0), acceleration=st.floats(0.1, 100.0),
    jerk=st.floats(1.0, 1e4),
)  # fmt: skip
def test_the_fastest_motion_over_a_way(way: float, velocity: float, acceleration: float, jerk: float) -> None:
    found = []
    for kernels in (COMPILED, PLAIN):
        times, jerks, motion = np.empty(7), np.empty(7), np.empty((3, 3))
        end_s = kernels.run.rest_to_rest(way, velocity, acceleration, jerk, times, jerks)
        kernels.run.phases(times, jerks, np.array([0.0, 0.4 * end_s, end_s]), motion)
        found.append(np.concatenate([[end_s], times, jerks, motion.ravel()]))
    assert np.array_equal(*found)
    end = found[0][-3:]
    assert np.allclose(end, [way, 0.0, 0.0], rtol=1e-9, atol=1e-9 * np.array([way, velocity, acceleration]))


@settings(max_examples=some(60), deadline=None)
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
    evenly, same = (
        kernels.straight.Evenly(way, velocity, acceleration, jerk, times[0], times[1])
        for kernels in (COMPILED, PLAIN)
    )
    assume(evenly.cells(end_s) <= MANY_CELLS)
    (x, clock), (same_x, same_clock) = evenly.found(end_s, UNIT_S), same.found(end_s, UNIT_S)
    assert np.array_equal(x, same_x)
    assert np.array_equal(clock, same_clock)
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


@settings(max_examples=some(60), deadline=None)
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
    for kernels in (COMPILED, PLAIN):
        way = way_of(kernels, 1)
        for controls in (np.linspace(2.9, -40.0, 30), np.full(30, np.nan), np.geomspace(1.0, 1e300, 30)):
            starts = np.zeros(28, dtype=np.intp)
            places = kernels.rows.layout(way, controls, 0, starts)
            assert places == starts[-1]
            assert (np.diff(starts) >= 2).all()
            assert (np.diff(starts) <= 40).all()


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), radius=st.floats(1e-6, 0.5))
def test_what_fits_at_a_target(seed: int, radius: float) -> None:
    rng = np.random.default_rng(seed)
    target, limits = rng.normal(size=JOINTS), rng.uniform(1.0, 2.0, (3, JOINTS)) * [[2.0], [10.0], [250.0]]
    bends = rng.normal(size=(2, 4, JOINTS)) * 0.3 ** np.arange(4)[:, None]
    found = []
    for kernels in (COMPILED, PLAIN):
        sides = [
            kernels.corner.Side(kernels.piecewise.Polynomial([0.0, 1.0], [bend], (), ()), *limits, at_end)
            for bend, at_end in zip(bends, (True, False), strict=True)
        ]
        times_s = [side.time_s(part) for side in sides for part in (1e-6, 0.003, 0.1, 0.9)]
        lowest, highest = target - 2.0, target + 2.0
        zone = kernels.zone.Zone(radius, target, np.empty((0, 12)))
        fitted = kernels.corner.fitted(*sides, 0.4, 0.3, zone, lowest, highest)
        found.append((times_s, fitted))
    assert found[0] == found[1]


@settings(max_examples=100, deadline=None)
@given(exponents=st.lists(st.floats(-4.0, 1.0), min_size=3, max_size=3), part=st.floats(0.0, 1.0))
def test_the_part_of_a_cell_at_a_time_is_exact_also_there(exponents: list[float], part: float) -> None:
    c = [10.0**each for each in exponents]
    kernel = PLAIN.motion
    left = part * kernel._time(*c, 1.0)
    found = kernel._part(*c, left)
    off = (kernel._time(*c, found) - left) * kernel._b(*c, found) ** 0.5
    assert abs(off) < 1e-13
