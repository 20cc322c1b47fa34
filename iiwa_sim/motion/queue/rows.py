"""What bounds the clock of a chain along its way, found in slices."""

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.queue.chain_kernel import Way
from iiwa_sim.motion.queue.rows_kernel import layout, write
from iiwa_sim.motion.slices import Slices
from iiwa_sim.motion.timing.bounds_kernel import Rows

UNIT_S = 0.01
"""The clock counts time in this unit."""
CELLS_IN_SLICE = 40


def rows_along(way: Way, controls: Array, kept: Rows | None) -> Slices[Rows]:
    """What bounds the clock over cells of x as a B-spline (N + 3,), of which the first ones are `kept`."""
    cells, first = len(controls) - 3, kept.cells if kept else 0
    starts = np.zeros(cells + 1, dtype=np.intp)
    if kept:
        starts[: first + 1] = kept.starts
    layout(way, way.edges, controls, first, starts)
    rows: Rows = Rows(starts, way.joint_count, kept)
    scratch = np.empty((15, way.joint_count))
    for k in range(first, cells, CELLS_IN_SLICE):
        last = min(k + CELLS_IN_SLICE, cells)
        write(way, way.edges, controls, k, last, UNIT_S, rows, scratch)
        yield
    return rows
