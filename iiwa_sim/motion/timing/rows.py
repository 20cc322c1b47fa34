"""What bounds the clock of a chain, over N cells."""

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.motion.limits import Array

Bounds = tuple[Array, Array, Array, Array, Array, Array]

TIGHT = (1.001, 1.0, 1.0, 1.0)
TIGHT_AT_END = (1.001, 1.0, 1.004, 1.004)
"""Factors on rows by their kind (velocity, acceleration, jerk at either end of a cell): between knots
velocities are a little larger than at them, in the last cell jerks are, too."""


class Rows(NamedTuple):
    """Bounds of a clock over N cells: factors in the clock's inequalities, over the limits (`clock_kernel`
    has the formulas), and from `inner` on the places between knots where `loads_kernel` looks at the
    limits."""

    a1: Array
    a2: Array
    cap: Array
    j1: Array
    j2: Array
    j3: Array
    counts: NDArray[np.intp]
    inner: Array
    starts: NDArray[np.intp]
    parts: Array
    per_limit: Array
    tight: Array
    """Factors (N + 1, 4) by which rows were multiplied so that limits hold between knots, too."""

    @classmethod
    def begun_with(cls, kept: Self | None, starts: NDArray[np.intp], joints: int) -> "Rows":
        """Rows for the N cells of `starts` (N + 1,): the first ones are those of `kept`, the others are to be
        written."""
        count, places = len(starts) - 1, int(starts[-1])
        rows = cls(
            np.zeros((count + 1, 2 * joints)),
            np.zeros((count + 1, 2 * joints)),
            np.zeros(count + 1),
            np.zeros((2 * count, 2 * joints)),
            np.zeros((2 * count, 2 * joints)),
            np.zeros((2 * count, 2 * joints)),
            np.zeros((count + 1, 3), dtype=np.intp),
            np.empty((places, 3, joints)),
            starts,
            np.empty(places),
            np.empty((count, 3, joints)),
            np.tile(TIGHT, (count + 1, 1)),
        )
        rows.tight[-2] = TIGHT_AT_END
        if kept is not None:
            for each, old in zip(rows, kept, strict=True):
                if each is not starts:
                    each[: len(old)] = old
            rows.tight[kept.cells] = TIGHT
        return rows

    @property
    def cells(self) -> int:
        return len(self.per_limit)

    @property
    def inside(self) -> tuple[Array, NDArray[np.intp], Array, Array]:
        """The places between knots, as `loads_kernel.inner_loads` takes them."""
        return self.inner, self.starts, self.parts, self.per_limit

    def like_rows(self) -> "Bounds":
        """New arrays, not filled, of the sizes of `a1` to `j3`."""
        a1, a2, cap, j1, j2, j3 = map(np.empty_like, self[:6])
        return a1, a2, cap, j1, j2, j3

    def part(self, first: int, last: int) -> "Rows":
        """Rows of the cells first..last - 1."""
        begins, ends = self.starts[first], self.starts[last]
        knots, sides = slice(first, last + 1), slice(2 * first, 2 * last)
        return Rows(
            self.a1[knots],
            self.a2[knots],
            self.cap[knots],
            self.j1[sides],
            self.j2[sides],
            self.j3[sides],
            self.counts[knots],
            self.inner[begins:ends],
            self.starts[knots] - begins,
            self.parts[begins:ends],
            self.per_limit[first:last],
            self.tight[knots],
        )
