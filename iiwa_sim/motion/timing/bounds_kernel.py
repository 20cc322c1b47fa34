"""What bounds the clock of a chain, over N cells: arrays that kernels read and write; compiled by Cython.

The clock is b(theta) = (dtheta/dt)^2, and theta counts cells. With the derivatives q', q'', q''' of a joint
over theta its acceleration is q'' b + q' b' / 2 and its jerk sqrt(b) (q''' b + 3/2 q'' b' + q' b'' / 2).
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

import cython
import numpy as np

# Velocities at knots count so many times as large, since between knots they may be a little larger,
VELOCITY = cython.declare(cython.double, 1.001)
# and so do jerks at both ends of the first cell from rest and of the last one: where x sets out or comes to
# rest, jerks within a cell are up to 1.6 % larger than at its ends.
AT_END = cython.declare(cython.double, 1.02)


@cython.cclass
class Bounds:
    """Bounds of b at knots, and rows: linear functions of c, over limits, that have to stay within -1 and 1.

    `a1`, `a2` (N + 1, n) are those of accelerations at knots, `cap` (N + 1,) what velocities leave b at
    knots, `j1`, `j2`, `j3` (2 N, n) those of jerks at both ends of each cell. Only the first `counts` (N +
    1, 3) of them count: at a knot, and at the beginning and the end of the cell behind it.
    """

    def __init__(self, cells: int, joints: int) -> None:
        """No rows yet, over so many cells."""
        self.cells = cells
        # Parts of one array, which is made sooner than five.
        n: cython.Py_ssize_t = cells
        m: cython.Py_ssize_t = 2 * (n + 1)
        block: cython.double[:, ::1] = np.zeros((m + 6 * n, joints))
        self.a1, self.a2 = block[: n + 1], block[n + 1 : m]
        self.j1, self.j2 = block[m : m + 2 * n], block[m + 2 * n : m + 4 * n]
        self.j3 = block[m + 4 * n :]
        self.cap, self.counts = np.zeros(n + 1), np.zeros((n + 1, 3), dtype=np.intp)

    def part(self, first: cython.Py_ssize_t, last: cython.Py_ssize_t) -> Bounds:
        """The bounds of the cells first..last - 1."""
        found: Bounds = Bounds.__new__(Bounds)
        found.cells = last - first
        found.a1, found.a2 = self.a1[first : last + 1], self.a2[first : last + 1]
        found.cap, found.counts = self.cap[first : last + 1], self.counts[first : last + 1]
        found.j1, found.j2 = self.j1[2 * first : 2 * last], self.j2[2 * first : 2 * last]
        found.j3 = self.j3[2 * first : 2 * last]
        return found


@cython.cclass
class Rows:
    """Bounds at knots and ends of cells, and what is looked at inside of them.

    `inner` (m, 3, n) are the first three derivatives of joints over theta at rising `parts` (m,) of cells,
    where those of the cell k are from `starts[k]` (N + 1,) on; of two equal parts one is before a jump, the
    other behind it. `peaks` (N, 3, n) are the largest of them in each cell, without their signs. `per_limit`
    (N, 3, n) is 1 over limits, in the clock's unit of time. `tight` (N + 1, 4)
    is how many times more velocities and accelerations at knots, and jerks at the beginning and the end of
    the cell behind it, count than they would. `cuts` (M, 7) are rows besides, each for a place within a cell:
    the cell, rising, the factors of its three coefficients c, and, of jerks, those of b there, else 0.
    """

    def __init__(self, starts: cython.Py_ssize_t[::1], joints: int, kept: Rows | None) -> None:
        """Bounds of the cells between `starts`, the first of them as they were kept."""
        cells: cython.Py_ssize_t = starts.shape[0] - 1
        self.bounds = Bounds(cells, joints)
        self.starts, self.inner = starts, np.empty((starts[cells], 3, joints))
        self.parts, self.per_limit = np.empty(starts[cells]), np.empty((cells, 3, joints))
        self.peaks = np.zeros((cells, 3, joints))
        self.tight, self.cuts = np.ones((cells + 1, 4)), np.empty((0, 7))
        self.tight[:, 0] = VELOCITY
        self.tight[cells - 1, 2:] = AT_END
        if kept is None:
            self.tight[0, 2:] = AT_END
        else:
            n, m = kept.bounds.cells, kept.parts.shape[0]
            self.bounds.a1[: n + 1] = kept.bounds.a1
            self.bounds.a2[: n + 1] = kept.bounds.a2
            self.bounds.cap[: n + 1] = kept.bounds.cap
            self.bounds.j1[: 2 * n] = kept.bounds.j1
            self.bounds.j2[: 2 * n] = kept.bounds.j2
            self.bounds.j3[: 2 * n] = kept.bounds.j3
            self.bounds.counts[: n + 1] = kept.bounds.counts
            self.inner[:m], self.parts[:m] = kept.inner, kept.parts
            self.per_limit[:n], self.tight[:n] = kept.per_limit, kept.tight[:n]
            self.peaks[:n] = kept.peaks
            self.cuts = kept.cuts

    @property
    def cells(self) -> int:
        return self.bounds.cells

    def part(self, first: cython.Py_ssize_t, last: cython.Py_ssize_t) -> Rows:
        """Rows of the cells first..last - 1."""
        found: Rows = Rows.__new__(Rows)
        begins: cython.Py_ssize_t = self.starts[first]
        ends: cython.Py_ssize_t = self.starts[last]
        found.bounds = self.bounds.part(first, last)
        found.inner, found.parts = self.inner[begins:ends], self.parts[begins:ends]
        found.starts = np.asarray(self.starts[first : last + 1]) - begins
        found.per_limit, found.tight = self.per_limit[first:last], self.tight[first : last + 1]
        found.peaks = self.peaks[first:last]
        cuts = np.asarray(self.cuts)
        cuts = cuts[(cuts[:, 0] >= first) & (cuts[:, 0] < last)]
        cuts[:, 0] -= first
        found.cuts = cuts
        return found
