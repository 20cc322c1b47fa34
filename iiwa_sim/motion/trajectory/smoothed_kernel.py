"""The sums of `iiwa_sim.motion.trajectory.smoothed`, in every tick of a trajectory: a curve averaged over
what lies just behind; compiled by Cython.

Both averages together are one with the weights of a trapezoid, which rises over the narrower width. Between
the corners of the trapezoid and the knots of the curve, weight times position is a polynomial of the sixth
degree, of which four places tell the exact integral (Gauss and Legendre).
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

import cython
import numpy as np

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.plan_kernel import Polynomial
else:
    from iiwa_sim.motion.plan_kernel import Polynomial
from iiwa_sim.motion.joints import Joints

_NEAR = cython.declare(cython.double, 0.33998104358485626)
_FAR = cython.declare(cython.double, 0.8611363115940526)
_NEAR_WEIGHT = cython.declare(cython.double, 0.6521451548625461)
_FAR_WEIGHT = cython.declare(cython.double, 0.34785484513745385)


@cython.cclass
class Averaged:
    """A curve over time (s), which stands still before and behind, averaged over two widths (s)."""

    _curve: Polynomial
    _narrow: cython.double
    _wide: cython.double
    _joints: cython.Py_ssize_t
    _values: cython.double[:, :, ::1]
    _sums: cython.double[::1]

    def __init__(self, curve: Polynomial, narrow_s: cython.double, wide_s: cython.double) -> None:
        """The wider is above 0."""
        self._curve, self._narrow, self._wide = curve, narrow_s, wide_s
        self._joints = curve.joint_count
        self._values, self._sums = np.empty((2, 1, self._joints)), np.empty(self._joints)

    def at(self, order: cython.int, time_s: cython.double) -> Joints:
        """The mean position (order 0) or velocity (order 1) over what lies just behind a time."""
        begin: cython.double = time_s - self._narrow - self._wide
        low: cython.double = begin
        whole: cython.double = 0.0
        knots = self._curve._borders
        last: cython.Py_ssize_t = knots.shape[0] - 1
        knot: cython.Py_ssize_t = self._curve._piece_at(begin)  # the next one, or before that
        for i in range(self._joints):
            self._sums[i] = 0.0
        while low < time_s:
            while knot <= last and knots[knot] <= low:
                knot += 1
            high = time_s
            if knot <= last:
                high = min(high, knots[knot])
            if low < begin + self._narrow:
                high = min(high, begin + self._narrow)
            elif low < begin + self._wide:
                high = min(high, begin + self._wide)
            half = 0.5 * (high - low)
            for k in range(4):
                far = k == 0 or k == 3
                place = (_FAR if far else _NEAR) * half
                place = low + half + (place if k > 1 else -place)
                weight = half * (_FAR_WEIGHT if far else _NEAR_WEIGHT)
                if self._narrow > 0.0:
                    weight *= min(1.0, (time_s - place) / self._narrow, (place - begin) / self._narrow)
                whole += weight
                if order == 0:
                    self._curve.evaluate(min(max(place, knots[0]), knots[last]), 0, self._values, 0)
                elif 0 < knot <= last:
                    self._curve.evaluate(place, 1, self._values, 0)
                else:
                    continue
                for i in range(self._joints):
                    self._sums[i] += weight * self._values[order, 0, i]
            low = high
        return tuple([self._sums[i] / whole for i in range(self._joints)])
