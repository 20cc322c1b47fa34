"""The clock of a chain: b(theta) = (dtheta/dt)^2, as fast as the limits of all joints allow.

theta counts cells, c are the coefficients of b as a quadratic B-spline (`clock_kernel`). An
interior-point method goes from one clock that keeps all limits to faster ones that do, too; before that,
limits that the first guess breaks are widened just enough, and the clock is moved to where less and less
is broken.
"""

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.slices import Slices
from iiwa_sim.motion.timing.bounds_kernel import Bounds, Rows
from iiwa_sim.motion.timing.clock_kernel import newton
from iiwa_sim.motion.timing.guess_kernel import going_on, steady_loads
from iiwa_sim.motion.timing.loads_kernel import (
    inner_loads,
    knot_loads,
    put_worst,
    tighten,
    tightened,
    widened,
)

CELL_STEPS = 1600
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
"""What is too much between knots counts so many times for them;"""
MORE_EACH = 0.3
"""where a clock is kept that it is to be like, only so much more in each repair."""
ROOM = 0.9998
"""Of limits, which that clock keeps also in the end."""
STUCK = 0.02
"""Of what is beside it: a coefficient below is where nearly nothing moves any more."""
KEPT_VELOCITY = 1.0009
VELOCITY_SLACK = 3e-4
"""So much more of a velocity counts like `KEPT` - 1 more of an acceleration: less than 1.001 is accepted."""
MU_FRESH, MU_WARM, MU_END, CUT = 2.0, 0.3, 0.003, 0.3


def steady(rows: Rows, widths: Array) -> Array:
    """The clock (N + 2,) that goes evenly over cells of nominal times (N,), as fast as all limits allow,
    almost."""
    c: Array = 1.0 / np.concatenate([widths[:1], widths, widths[-1:]]) ** 2
    squares, cubes = steady_loads(rows.bounds, c)
    scaled: Array = c * (0.999 * min(1.0 / max(squares, 1e-12), max(cubes, 1e-18) ** (-2.0 / 3.0)))
    return scaled


def quick(rows: Rows, c: Array, most_steps: int = 0, mu_end: float = MU_END) -> bool:
    """Bring a steady clock (N + 2,) that starts from rest nearer to the fastest one, in place, in so many
    Newton steps, or half a slice. Whether there is little left to gain."""
    cells = rows.cells
    vectors, band, loads = np.empty((3, cells + 2)), np.empty((cells + 2, 3)), np.empty((cells, 3))
    bounds: Bounds = rows.bounds.like()
    tightened(rows, bounds)
    c *= QUICK_START
    steps = most_steps or max(CELL_STEPS // cells, 1)
    _, _, over = newton(bounds, c, vectors, band, MU_WARM, mu_end, CUT, 0, steps)
    inner_loads(rows, c, loads)
    largest = _too_fast(loads)
    if largest > 1.0:
        c /= largest
    return bool(over) and largest < ALMOST


def guess(rows: Rows, widths: Array, last: Array) -> Array:
    """A first guess of a clock (M + 2,) over the last cells, of nominal times (M,), behind the last two
    coefficients of what was there before."""
    c = np.empty(len(widths) + 2)
    c[:2] = last
    going_on(rows, widths, np.empty((2, len(widths))), c)
    return c


def fastest(rows: Rows, c: Array, fixed: int, kept: int) -> Slices[bool]:
    """Bring c (N + 2,) from a first guess to nearly the fastest clock, in place, but for the first `fixed`
    of them.

    Over the first `kept` cells the guess keeps the limits, or nearly. False, and c is of no use, where no
    clock was found that does everywhere.
    """
    cells = rows.cells
    bounds: Bounds = rows.bounds.like()
    wide: Bounds = bounds.like()
    vectors, band = np.empty((3, cells + 2)), np.empty((cells + 2, 3))
    loads, ends = np.empty((cells, 3)), np.empty((cells + 1, 4))
    chunk = max(CELL_STEPS // cells, 1)
    spent = 0
    best: tuple[float, Array, float] | None = None
    mu_start = MU_WARM if fixed else MU_FRESH
    allowed = np.tile([1.0, KEPT, KEPT], (cells, 1))
    worst = np.empty(2, dtype=np.intp)
    tight, most = np.asarray(rows.tight), np.full((cells + 1, 4), np.inf)
    if kept:
        # There may be no better way than the one that is kept: there no more is asked for.
        inner_loads(rows, c, loads)
        np.maximum(allowed[:kept], loads[:kept], out=allowed[:kept])
        knot_loads(rows.bounds, c, ends)
        most[:kept] = np.maximum(ROOM / np.maximum(ends[:kept], 1e-9), 1.0)
        np.minimum(tight, most, out=tight)
    tightened(rows, bounds)
    yield
    for repair in range(REPAIRS + 1):
        last = 1e30
        for k in range(ROUNDS):
            load = widened(bounds, c, wide)
            if load < 0.9999:
                break
            if k > 4 and load - 1.0 > LITTLE_GAIN * (last - 1.0):
                return _best(best, c, fixed)
            last = load
            newton(wide, c, vectors, band, 1.0, 1.0, 1.0, fixed, ROUND_STEPS)
            spent += ROUND_STEPS
            if spent >= chunk:
                spent = 0
                yield
        else:
            return _best(best, c, fixed)
        mu, steps, over = mu_start, 0, False
        while not over and steps < MOST_STEPS:
            most_steps = min(chunk - spent, MOST_STEPS - steps)
            mu, done, over = newton(bounds, c, vectors, band, mu, MU_END, CUT, fixed, most_steps)
            steps += done
            spent += done
            if spent >= chunk:
                spent = 0
                yield
        if _lifted(c, fixed):
            mu_start = 0.05
            continue
        inner_loads(rows, c, loads)
        over_allowed = (loads - allowed).max(axis=0).tolist()
        excess = 1.0 + max(
            (over_allowed[0] + 1.0 - KEPT_VELOCITY) / VELOCITY_SLACK,
            max(over_allowed[1:]) / (KEPT - 1.0),
        )
        if best is None or excess < best[0]:
            best = excess, c.copy(), _too_fast(loads)
        if excess <= 1.0:
            return True
        put_worst(rows, c, loads, allowed, kept, worst)
        knot_loads(bounds, c, ends)
        tighten(loads, ends, allowed, kept, OVERDONE, 1.0 + MORE_EACH * repair, tight, most)
        tightened(rows, bounds)
        mu_start = 0.05
    return _best(best, c, fixed)


def _lifted(c: Array, fixed: int) -> bool:
    """Whether steps have led to where the chain all but stands still for a knot: there it keeps all limits,
    and none leads out. Such coefficients are then like those beside them."""
    beside = 0.5 * (c[:-2] + c[2:])
    stuck = c[1:-1] < STUCK * beside
    stuck[: max(fixed - 1, 0)] = False
    if not stuck.any():
        return False
    c[1:-1][stuck] = 0.5 * beside[stuck]
    return True


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
