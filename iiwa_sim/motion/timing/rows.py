"""What bounds the clock of a chain, over N cells."""

from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.motion.limits import Array

Bounds = tuple[Array, Array, Array, Array, Array, Array]

TIGHT = (1.001, 1.0, 1.0, 1.0)
TIGHT_AT_END = (1.001, 1.0, 1.004, 1.004)
"""Between knots of a cell that is like others, velocities are a little larger; in the last cell jerks are."""


class Rows(NamedTuple):
    """See `clock_kernel`, and `loads_kernel.inner_loads` for `inner` to `per_limit`."""

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
    """How many times more rows were made to count, so that limits hold between them, too: see `tighten`."""

    @classmethod
    def begun_with(cls, kept: Self | None, starts: NDArray[np.intp], joints: int) -> "Rows":
        """Of as many cells as `starts` (N + 1,) has, the first of them as they were kept."""
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
        """What `inner_loads` wants."""
        return self.inner, self.starts, self.parts, self.per_limit

    def like_rows(self) -> "Bounds":
        """Room for other rows of the same sizes."""
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
