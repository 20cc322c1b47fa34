"""The clock of a chain: b(theta) = (dtheta/dt)^2, as fast as the limits of all joints allow.

theta counts cells, c are the coefficients of b as a quadratic B-spline (`clock_kernel`). A
primal-dual interior-point method brings a first guess, which may break limits, to where all are kept and
nothing is left to gain. Where one is passed between the places that it knew of, it gets a row for that,
and goes on.
"""

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.slices import Slices
from iiwa_sim.motion.timing.bounds_kernel import Rows
from iiwa_sim.motion.timing.clock_kernel import Steps, lifted
from iiwa_sim.motion.timing.cuts_kernel import cut
from iiwa_sim.motion.timing.guess_kernel import going_on, knot_loads, steady_loads
from iiwa_sim.motion.timing.loads_kernel import beyond, inner_loads

CELL_STEPS = 2400
"""Newton steps times cells in a slice: some 0.4 ms."""
FEW_CELLS = 150
"""Of fewer, a look into cells and the first steps behind it are one slice."""
MOST_STEPS, MOST_AGAIN = 40, 15
"""Newton steps of a clock, and of one that is gone on with for another row."""
REPAIRS = 8
QUICK_START = 0.97
ALMOST = 1.004
KEPT = 1.004
"""Of acceleration and jerk between knots; more is repaired."""
ACCEPTED = 0.3
"""Part of what is too much that is accepted, where no better clock was found."""
ROOM = 0.9998
"""Of limits: what is kept of an old clock has so much room to all."""
KEPT_VELOCITY = 1.0009
MU, MU_NEAR, LEAST = 0.3, 0.1, 0.2
"""With which a clock begins (see `Steps.begin`), at an even pace or from a guess: others take more steps."""
ENOUGH = 0.02
"""Part of the time that may be left to gain by what the multipliers say: a tenth of it is."""


def steady(rows: Rows, widths: Array) -> Array:
    """The clock (N + 2,) that goes evenly over cells of nominal times (N,), as fast as all limits allow,
    almost."""
    c: Array = 1.0 / np.concatenate([widths[:1], widths, widths[-1:]]) ** 2
    squares, cubes = steady_loads(rows.bounds, c)
    scaled: Array = c * (0.999 * min(1.0 / max(squares, 1e-12), max(cubes, 1e-18) ** (-2.0 / 3.0)))
    return scaled


def quick(rows: Rows, c: Array, most_steps: int = 0, enough: float = ENOUGH) -> bool:
    """Bring a steady clock (N + 2,) that starts from rest nearer to the fastest one, in place, in so many
    steps, or half a slice. Whether there is little left to gain."""
    loads = np.empty((rows.cells, 3))
    c *= QUICK_START
    steps = Steps(rows, 0)
    steps.begin(c, MU_NEAR, LEAST)
    _, over = steps.go(c, most_steps or max(CELL_STEPS // rows.cells, 1), enough)
    inner_loads(rows, c, rows.cells, loads)
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
    loads = np.empty((cells, 3))
    chunk = max(CELL_STEPS // cells, 1)
    best: tuple[float, Array, Array] | None = None
    allowed = np.empty((cells, 3))
    allowed[:] = KEPT_VELOCITY, KEPT, KEPT
    if kept:
        # There may be no better way than the one that is kept: there no more is asked for.
        inner_loads(rows, c, kept, loads)
        np.maximum(allowed[:kept], loads[:kept], out=allowed[:kept])
        ends = np.empty((cells + 1, 4))
        knot_loads(rows.bounds, c, ends)
        tight = np.asarray(rows.tight)[:kept]
        np.minimum(tight, np.maximum(ROOM / np.maximum(ends[:kept], 1e-9), 1.0), out=tight)
    steps, cuts = None, np.asarray(rows.cuts)
    for _ in range(REPAIRS + 1):
        anew = steps is None
        if anew or cells > FEW_CELLS:
            yield
        if steps is None:
            steps = Steps(rows, fixed)
            steps.begin(c, MU, LEAST)
        else:
            steps.add(cuts, c)
        spent, over, most = 0, False, MOST_STEPS if anew else MOST_AGAIN
        while not over:
            # What comes before the first of them takes its time, too.
            done, over = steps.go(c, min(chunk if spent else (chunk + 1) // 2, most - spent), ENOUGH)
            spent += done
            if not over and (not done or spent == most):
                break
            yield
        if not over and anew:
            return _best(best, c, fixed)
        if not over or lifted(c, fixed):
            steps = None
            continue
        inner_loads(rows, c, cells, loads)
        excess = beyond(loads, allowed)
        if excess <= 0.0:
            return True
        if best is None or excess < best[0]:
            best = excess, c.copy(), loads.copy()
        cuts = cut(rows, c, loads, allowed)
        rows.cuts = np.concatenate([rows.cuts, cuts])
    return _best(best, c, fixed)


def _best(best: tuple[float, Array, Array] | None, c: Array, fixed: int) -> bool:
    """Let c be the best clock found, if it is good enough; one from rest is slowed down for that."""
    if best is None or (fixed and best[0] > ACCEPTED):
        return False
    c[:] = best[1]
    if not fixed:
        c /= max(_too_fast(best[2]), 1.0)
    return True


def _too_fast(loads: Array) -> float:
    """By what a clock (N + 2,) with such velocities, accelerations and jerks inside cells (N, 3) is to be
    divided."""
    velocity, acceleration, jerk = loads.max(axis=0).tolist()
    return float(max(velocity**2, acceleration / KEPT, (jerk / KEPT) ** (2.0 / 3.0)))
