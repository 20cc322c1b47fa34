"""The clock of a chain: b(theta) = (dtheta/dt)^2, as fast as the limits of all joints allow.

theta counts cells, c are the coefficients of b as a quadratic B-spline (`clock_kernel`). An
interior-point method goes from one clock that keeps all limits to faster ones that do, too; before that,
limits that the first guess breaks are widened just enough, and the clock is moved to where less and less
is broken.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.slices import Slices
from iiwa_sim.motion.timing.clock_kernel import newton
from iiwa_sim.motion.timing.loads_kernel import inner_loads, steady_loads, widened

CELL_STEPS = 800
"""Newton steps times cells in a slice: half a millisecond."""
ROUNDS = 15  # of widening
ROUND_STEPS = 4
LITTLE_GAIN = 0.95  # of what is broken: a round that leaves more finds no way on
MOST_STEPS = 40
REPAIRS = 8
QUICK_START = 0.97
ALMOST = 1.004
KEPT = 1.004
"""Of acceleration and jerk between knots; more is repaired."""
ACCEPTED = 1.3
"""Of what is too much, where no better clock was found."""
OVERDONE = 2.2
NEAR_FROZEN = 24  # cells
MORE_EACH = 0.3
LEAST_LOAD = 0.4
KEPT_VELOCITY = 1.0004
MU_FRESH, MU_WARM, MU_END, CUT = 2.0, 0.3, 0.003, 0.3


Bounds = tuple[Array, Array, Array, Array, Array, Array]


class Rows(NamedTuple):
    """What bounds a clock over N cells: see `clock_kernel`, and `inner_loads` for the last four."""

    a1: Array
    a2: Array
    cap: Array
    j1: Array
    j2: Array
    j3: Array
    inner: Array
    inner_cells: NDArray[np.intp]
    inner_parts: Array
    cell_limits: Array

    @property
    def bounds(self) -> Bounds:
        """Copies of the first six."""
        return (
            self.a1.copy(),
            self.a2.copy(),
            self.cap.copy(),
            self.j1.copy(),
            self.j2.copy(),
            self.j3.copy(),
        )


def steady(rows: Rows, widths: Array) -> Array:
    """The clock (N + 2,) that goes evenly over cells of nominal times (N,), as fast as all limits allow,
    almost."""
    c: Array = 1.0 / np.concatenate([widths[:1], widths, widths[-1:]]) ** 2
    squares, cubes = steady_loads(*rows[:6], c)
    scaled: Array = c * (0.999 * min(1.0 / max(squares, 1e-12), max(cubes, 1e-18) ** (-2.0 / 3.0)))
    return scaled


def quick(rows: Rows, c: Array) -> bool:
    """Bring a steady clock (N + 2,) that starts from rest nearer to the fastest one, in place, in half a
    slice. Whether there is little left to gain."""
    cells = len(rows.cap) - 1
    vectors, band, loads = np.empty((3, cells + 2)), np.empty((cells + 2, 3)), np.empty((cells, 3))
    c *= QUICK_START
    _, _, over = newton(*rows[:6], c, vectors, band, MU_WARM, MU_END, CUT, 0, max(CELL_STEPS // cells, 1))
    inner_loads(rows.inner, rows.inner_cells, rows.inner_parts, rows.cell_limits, c, loads)
    largest = _too_fast(loads)
    if largest > 1.0:
        c /= largest
    return bool(over) and largest < ALMOST


def fastest(rows: Rows, c: Array, fixed: int) -> Slices[bool]:
    """Bring c (N + 2,) from a first guess to nearly the fastest clock, in place, but for the first `fixed`
    of them.

    False, and c is of no use, where none was found that keeps the limits.
    """
    cells = len(rows.cap) - 1
    bounds, wide = rows.bounds, rows.bounds
    vectors, band = np.empty((3, cells + 2)), np.empty((cells + 2, 3))
    loads = np.empty((cells, 3))
    chunk = max(CELL_STEPS // cells, 1)
    spent = 0
    best: tuple[float, Array, float] | None = None
    mu_start = MU_WARM if fixed else MU_FRESH
    for repair in range(REPAIRS + 1):
        last = 1e30
        for k in range(ROUNDS):
            load = widened(*bounds, c, *wide)
            if load < 0.9999:
                break
            if k > 4 and load - 1.0 > LITTLE_GAIN * (last - 1.0):
                return _best(best, c, fixed)
            last = load
            newton(*wide, c, vectors, band, 1.0, 1.0, 1.0, fixed, ROUND_STEPS)
            spent += ROUND_STEPS
            if spent >= chunk:
                spent = 0
                yield
        else:
            return _best(best, c, fixed)
        mu, steps, over = mu_start, 0, False
        while not over and steps < MOST_STEPS:
            mu, done, over = newton(
                *bounds, c, vectors, band, mu, MU_END, CUT, fixed, min(chunk - spent, MOST_STEPS - steps)
            )
            steps += done
            spent += done
            if spent >= chunk:
                spent = 0
                yield
        inner_loads(rows.inner, rows.inner_cells, rows.inner_parts, rows.cell_limits, c, loads)
        worst = loads.max(axis=0)
        excess = max((worst[0] - 1.0) / (KEPT_VELOCITY - 1.0), (max(worst[1], worst[2]) - 1.0) / (KEPT - 1.0))
        if best is None or excess < best[0]:
            best = excess, c.copy(), _too_fast(loads)
        if excess <= 1.0:
            return True
        _tighten(bounds, loads, c, repair if fixed else None)
        mu_start = 0.05
    return _best(best, c, fixed)


def _best(best: tuple[float, Array, float] | None, c: Array, fixed: int) -> bool:
    """Let c be the best clock found, if it is good enough; one from rest is slowed down for that."""
    if best is None or (fixed and best[0] > ACCEPTED):
        return False
    c[:] = best[1]
    if not fixed:
        c /= max(best[2], 1.0)
    return True


def _too_fast(loads: Array) -> float:
    """By what a clock (N + 2,) with such velocities, accelerations and jerks inside cells (N, 3) is to be
    divided."""
    velocity, acceleration, jerk = loads.max(axis=0).tolist()
    return float(max(velocity**2, acceleration / KEPT, (jerk / KEPT) ** (2.0 / 3.0)))


def _tighten(bounds: Bounds, loads: Array, c: Array, repair: int | None) -> None:
    """Let the limits at knots be as much tighter as they were passed between them.

    Next to what is frozen there may be no better way than that of the chain before: there no more than
    needed.
    """
    a1, a2, cap, *jerks = bounds
    velocity, acceleration, jerk = loads.T
    overdone = np.full(len(loads), OVERDONE)
    if repair is not None:
        overdone[:NEAR_FROZEN] = 1.0 + MORE_EACH * repair
    over = np.where(velocity > 1.0, velocity * velocity * 1.001, 1.0)
    cap /= np.maximum(np.append(over, 1.0), np.append(1.0, over))
    over = np.where(acceleration > KEPT, acceleration**overdone, 1.0)
    over = np.maximum(np.append(over, 1.0), np.append(1.0, over))
    a1 *= over[:, None]
    a2 *= over[:, None]
    # A jerk inside a cell may be far above those at its ends: then these are to count for it.
    far = np.clip(_jerks(jerks, c), LEAST_LOAD, 1.0)
    if repair is not None:
        far[:NEAR_FROZEN] = 1.0
    over = np.minimum(jerk**overdone, 2.0) / far
    over = np.repeat(np.where(jerk > KEPT, over, 1.0), 2)
    for each in jerks:
        each *= over[:, None]


def _jerks(rows: Sequence[Array], c: Array) -> Array:
    """The largest jerks at the ends of cells (N,), as parts of what these rows allow."""
    j1, j2, j3 = (each.reshape(len(c) - 2, 2, -1) for each in rows)
    b, slope, bend = 0.5 * (c[:-1] + c[1:]), np.diff(c), np.diff(c, 2)[:, None, None]
    at_ends = np.stack([b[:-1], b[1:]], axis=1)[..., None]
    slopes = np.stack([slope[:-1], slope[1:]], axis=1)[..., None]
    jerks: Array = np.abs(np.sqrt(at_ends) * (j3 * at_ends + j2 * slopes + j1 * bend)).max(axis=(1, 2))
    return jerks
