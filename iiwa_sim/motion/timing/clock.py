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
from iiwa_sim.motion.timing.clock_kernel import Steps
from iiwa_sim.motion.timing.cuts_kernel import cut
from iiwa_sim.motion.timing.guess_kernel import going_on, knot_loads, lifted
from iiwa_sim.motion.timing.loads_kernel import beyond, inner_loads

CELL_STEPS = 1600
"""Newton steps times cells in a slice: some 0.3 ms."""
FEW_CELLS, LOOK_STEPS = 20, 3
"""Least number of cells that one look asks about, and how many Newton steps such a look takes as long as."""
IDLE = 0.15
"""Rows at less than this part of their limit are left out when a clock is gone on with."""
BESIDE = 16
"""Number of cells on either side of one that gets a row whose clock is changed for that row."""
MOST_STEPS, MOST_AGAIN = 40, 15
"""Most Newton steps of a clock that is found afresh, and of one that is found again for a further row."""
REPAIRS = 8
"""Most times that a clock is found again for rows that a look inside cells has added."""
AT_FIRST = 2
"""Most slices of planning for the clock of a move that sets out alone."""
KEPT = 1.004
"""Part of a limit of acceleration or jerk that is left as it is between knots; more is repaired."""
ACCEPTED = 0.3
"""Part of what is too much that is accepted, where no better clock was found."""
ROOM = 0.9998
"""Part of each limit within which what is kept of an old clock is to stay."""
KEPT_VELOCITY = 1.0009
MU, LEAST = 0.1, 0.2
"""With which a clock begins (see `Steps.begin`)."""
ENOUGH = 0.03
"""Part of the time that may be left to gain by what the multipliers say: a tenth of it is."""


def quick(rows: Rows, c: Array) -> bool:
    """Bring a steady clock (N + 2,) that starts from rest to nearly the fastest one, in place, as far as that
    takes no more than `AT_FIRST` slices; then it is one that keeps all limits. Whether it is nearly the
    fastest one."""
    work = fastest(rows, c, 0, 0)
    try:
        for _ in range(AT_FIRST):
            next(work)
    except StopIteration as end:
        if end.value:
            return True
    loads = np.empty((rows.cells, 3))
    inner_loads(rows, c, 0, rows.cells, loads)
    c /= max(_too_fast(loads), 1.0)
    return False


def guess(rows: Rows, widths: Array, last: Array) -> Array:
    """A first guess of a clock (M + 2,) over the last cells, of nominal times (M,), behind the last two
    coefficients of what was there before."""
    c = np.empty(len(widths) + 2)
    c[:2] = last
    going_on(rows, widths, np.empty((2, len(widths))), c)
    return c


def fastest(rows: Rows, c: Array, fixed: int, kept: int, enough: float = ENOUGH) -> Slices[bool]:
    """Bring c (N + 2,) from a first guess to nearly the fastest clock, in place, but for the first `fixed`
    of them. `enough` is the part of the time that may be left to gain by what the multipliers say.

    Over the first `kept` cells the guess keeps the limits, or nearly. False, and c is of no use, where no
    clock was found that does everywhere.
    """
    cells = rows.cells
    loads = np.empty((cells, 3))
    best: tuple[float, Array, Array] | None = None
    allowed = np.empty((cells, 3))
    allowed[:] = KEPT_VELOCITY, KEPT, KEPT
    if kept:
        # There may be no better way than the one that is kept: there no more is asked for.
        inner_loads(rows, c, 0, kept, loads)
        np.maximum(allowed[:kept], loads[:kept], out=allowed[:kept])
        ends = np.empty((cells + 1, 4))
        knot_loads(rows.bounds, c, ends)
        tight = np.asarray(rows.tight)[:kept]
        np.minimum(tight, np.maximum(ROOM / np.maximum(ends[:kept], 1e-9), 1.0), out=tight)
    steps, spans, spent, over = None, [(0, cells)], LOOK_STEPS * (kept + cells), False
    for _ in range(REPAIRS + 1):
        anew = steps is None
        if steps is None:
            spans = [(0, cells)]
            steps = Steps(rows, fixed)
            steps.begin(c, MU, LEAST)
        for begins, ends_at in spans:
            if not anew:
                steps.go_on(c, begins, ends_at)
            over, left = False, MOST_STEPS if anew else MOST_AGAIN
            while not over and left:
                if spent >= CELL_STEPS:
                    yield
                    spent = 0
                most = max((CELL_STEPS - spent) // (ends_at - begins), 1)
                done, over = steps.go(c, min(most, left), enough)
                left = left - done if done else 0
                spent += max(done, 1) * (ends_at - begins)
            if not over:
                break
        if not over and anew:
            return _best(best, c, fixed)
        if not over or lifted(c, fixed):
            steps = None
            continue
        for begins, ends_at in spans:
            while begins < ends_at:
                if spent >= CELL_STEPS:
                    yield
                    spent = 0
                until = min(begins + max((CELL_STEPS - spent) // LOOK_STEPS, FEW_CELLS), ends_at)
                inner_loads(rows, c, begins, until, loads)
                spent += LOOK_STEPS * (until - begins)
                begins = until
        excess = beyond(loads, allowed)
        if excess <= 0.0:
            return True
        if best is None or excess < best[0]:
            best = excess, c.copy(), loads.copy()
        cuts = cut(rows, c, loads, allowed)
        steps.add(cuts, c, IDLE if anew else 0.0)
        spent += 2 * cells
        spans = _spans(cuts[:, 0], cells)
        rows.cuts = np.concatenate([rows.cuts, cuts])
    return _best(best, c, fixed)


def _spans(at: Array, cells: int) -> list[tuple[int, int]]:
    """The cells so near to some that they are changed together with them, as ranges that do not meet."""
    found: list[tuple[int, int]] = []
    for k in at.astype(int).tolist():
        begins, ends = max(k - BESIDE, 0), min(k + BESIDE + 1, cells)
        if found and begins <= found[-1][1] + 2:
            begins = found.pop()[0]
        found.append((begins, ends))
    return found


def _best(best: tuple[float, Array, Array] | None, c: Array, fixed: int) -> bool:
    """Let c be the best clock found, if it is good enough; one from rest is slowed down for that."""
    if best is None or (fixed and best[0] > ACCEPTED):
        return False
    c[:] = best[1]
    if not fixed:
        c /= max(_too_fast(best[2]), 1.0)
    return True


def _too_fast(loads: Array) -> float:
    """The number by which a clock (N + 2,) with such velocities, accelerations and jerks (N, 3), in its
    cells, is to be divided."""
    velocity, acceleration, jerk = loads.max(axis=0).tolist()
    return float(max(velocity**2, acceleration / KEPT, (jerk / KEPT) ** (2.0 / 3.0)))
