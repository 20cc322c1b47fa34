"""The kernel of straight chains: what it finds keeps its limits."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from iiwa_sim.motion.queue import straight_kernel
from iiwa_sim.motion.queue.planning import MANY_CELLS
from iiwa_sim.motion.timing import run_kernel

UNIT_S = 0.01


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
