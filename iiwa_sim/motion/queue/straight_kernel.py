"""The fastest motion from rest to rest of one number, as x of a chain whose clock goes evenly; compiled by
Cython.

At constant jerks, accelerations are straight lines over time. Told at even times, and straight between these,
they change no faster, and are nowhere larger: so no clock has to be looked for.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt
from numpy.typing import NDArray

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.timing.run_kernel import root
else:
    from iiwa_sim.motion.timing.run_kernel import root

# A cell takes no longer, and so many of them no longer than speeding up does; a motion has no fewer cells,
CELL_S = cython.declare(cython.double, 0.01)
SPEEDING_UP = cython.declare(cython.double, 3.0)
LEAST_CELLS = cython.declare(cython.double, 24.0)
# and at most so many times more than that asks for.
MORE = cython.declare(cython.Py_ssize_t, 2)
# A motion that takes no longer than so many times the fastest is fast enough.
ENOUGH = cython.declare(cython.double, 1.0002)


@cython.cclass
class Evenly:
    """A motion over a way within limits of velocity, acceleration and jerk, in as many cells as make it
    nearly the fastest: in that, acceleration builds up for `building_s`, and stays for `even_s`.

    The second half of it mirrors the first, and so its cells come in two halves.
    """

    _way: cython.double
    _velocity: cython.double
    _acceleration: cython.double
    _jerk: cython.double
    _building_s: cython.double
    _even_s: cython.double
    _scale: cython.double  # of x
    _speed: cython.double  # in cells a second

    def __init__(
        self,
        way: cython.double,
        velocity: cython.double,
        acceleration: cython.double,
        jerk: cython.double,
        building_s: cython.double,
        even_s: cython.double,
    ) -> None:
        self._way, self._velocity, self._acceleration, self._jerk = way, velocity, acceleration, jerk
        self._building_s, self._even_s = building_s, even_s
        self._scale = self._speed = 0.0

    @cython.ccall
    def cells(self, fastest_s: cython.double) -> cython.double:
        """How many cells it has at least, where the fastest motion takes `fastest_s`."""
        speeding_s = 2.0 * self._building_s + self._even_s
        return max(LEAST_CELLS, fastest_s / CELL_S, SPEEDING_UP * fastest_s / speeding_s)

    def found(
        self, fastest_s: cython.double, unit_s: cython.double
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Coefficients (N + 3,) of x as a cubic B-spline over cells, and of its clock (N + 2,), which counts
        time in a unit. The fastest motion takes `fastest_s`."""
        least: cython.Py_ssize_t = int(0.5 * self.cells(fastest_s) + 0.999)
        best: cython.Py_ssize_t = least
        best_s: cython.double = 1e300
        for half in range(least, MORE * least + 1):
            self._try(0.5 * fastest_s / half, half)
            whole_s = 2.0 * half / self._speed
            if whole_s < best_s:
                best, best_s = half, whole_s
            if best_s <= ENOUGH * fastest_s:
                break
        controls_array = np.zeros(2 * best + 3)
        controls: cython.double[::1] = controls_array
        cell_s: cython.double = 0.5 * fastest_s / best
        pace: cython.double = 0.0
        self._try(cell_s, best)
        for k in range(1, best):
            pace += self._scale * self._bend(k * cell_s)
            controls[k + 2] = controls[k + 1] + pace
        for k in range(best + 1):
            controls[2 * best + 2 - k] = self._way - controls[k]
        controls[best + 1] = 0.5 * self._way
        speed = self._speed * unit_s
        clock: NDArray[np.float64] = np.full(2 * best + 2, speed * speed)
        return controls_array, clock

    @cython.cfunc
    @cython.exceptval(check=False)
    def _bend(self, t: cython.double) -> cython.double:
        """The acceleration after a time in the first half, over the jerk."""
        return max(min(t, self._building_s, 2.0 * self._building_s + self._even_s - t), 0.0)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _try(self, cell_s: cython.double, half: cython.Py_ssize_t) -> cython.void:
        """Find the scale, and how fast it may go, with so many cells in each half.

        Second differences of coefficients are accelerations, here as they would be at a jerk of 1.
        """
        last: cython.double = 0.0
        most: cython.double = 0.0
        change: cython.double = 0.0
        pace: cython.double = 0.0
        x: cython.double = 0.0
        k: cython.Py_ssize_t = 0
        bend: cython.double = 1.0
        while bend > 0.0:
            k += 1
            bend = self._bend(k * cell_s) if k < half else 0.0
            most = max(most, bend)
            change = max(change, fabs(bend - last))
            last = bend
            pace += bend
            if k < half:
                x += pace
        x += pace * max(half - 1 - k, 0)
        self._scale = 0.5 * self._way / x
        self._speed = self._velocity / (self._scale * pace)
        self._speed = min(self._speed, sqrt(self._acceleration / (self._scale * most)))
        self._speed = min(self._speed, root(self._jerk / (self._scale * change)))
