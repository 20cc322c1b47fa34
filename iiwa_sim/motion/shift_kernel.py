"""The shift of the TCP off the plan by forces and surfaces: a damped mass on springs, in translation."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from math import ceil
from typing import Any

import cython
import numpy as np

from iiwa_sim.motion.spring import damping, spring
from iiwa_sim.motion.surroundings import LONGEST_SUBSTEP_S

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.feeling_kernel import Feeling
else:
    from iiwa_sim.robot.feeling_kernel import Feeling

MASS_KG = 5.0
"""Apparent mass of the TCP. Our decision: about what an iiwa's TCP weighs in the middle of its work space."""
LEAST_DAMPING_NS_PER_M = 20.0
"""Our decision: without a spring, 10 N move the TCP at 0.5 m/s. Below 40.8 N/m the ratio is above 0.7."""
_MASS_KG = cython.declare(cython.double, 5.0)


@cython.cclass
class Shift:
    """Moves the shift (m) and its velocity (m/s) on, tick by tick. All vectors are in the base.

    Spring and damper are moved on exactly (`spring.py`) at any tick rate. Contact comes in by half kicks
    before and after each of its substeps (velocity Verlet), which keeps energy from growing on stiff
    surfaces.
    """

    def __init__(self, tick_s: float, feeling: Feeling | None) -> None:
        """`feeling` is None where there is nothing to touch."""
        self._tick_s = tick_s
        self._feels = feeling is not None
        self._feeling: Any = feeling
        self._substeps = ceil(tick_s / LONGEST_SUBSTEP_S - 1e-9)
        self._stiffness = -1.0  # N/m, of the two springs
        self._alone = np.zeros(6)
        self._in_contact = np.zeros(6)
        self.acting, self._seen = np.zeros((2, 6))
        self._place, self._velocity = np.zeros(3), np.zeros(3)
        self.torque = np.zeros(3)
        self.touches = False

    @cython.cfunc
    @cython.exceptval(check=True)
    def start(self, at: cython.double[::1]) -> cython.void:
        """The TCP is at rest at a place (m), the last three of twelve numbers."""
        self.touches = False
        for k in range(6):
            self.acting[k] = 0.0
        if self._feels:
            self.touches = self._feeling.acts_at(at[9], at[10], at[11], 0.0, 0.0, 0.0, False, self.acting)

    @cython.cfunc
    @cython.exceptval(-1)
    def meets(self, at: cython.double[::1], moved: cython.double[::1]) -> cython.bint:
        """Whether a surface acts at a place (m), the last three of twelve numbers, at the end of a tick of
        moving so far (m)."""
        if not self._feels:
            return False
        tick, f = self._tick_s, self._feeling
        vx, vy, vz = moved[0] / tick, moved[1] / tick, moved[2] / tick
        return f.acts_at(at[9], at[10], at[11], vx, vy, vz, False, self._seen)

    @cython.cfunc
    @cython.exceptval(-1)
    def step(
        self,
        stiffness: cython.double,
        x: cython.double[::1],
        v: cython.double[::1],
        force: cython.double[::1],
        was: cython.double[::1],
        moved: cython.double[::1],
    ) -> cython.bint:
        """Move shift and velocity on by a tick; whether a surface was felt in it, and then `torque` is of it.

        The stiffness is in N/m; the force (N) is what acts besides surfaces; the plan has `moved` so far (m)
        from where it `was`. Only the first three numbers of each are read and written.
        """
        if stiffness != self._stiffness:
            self._stiffness = stiffness
            damped = damping(MASS_KG, stiffness, LEAST_DAMPING_NS_PER_M)
            self._alone = spring(MASS_KG, stiffness, damped, self._tick_s)
            part_s = self._tick_s / self._substeps
            self._in_contact = spring(MASS_KG, stiffness, damped, part_s)
        if not self.touches:
            c, tick, a, u = self._alone, self._tick_s, self._place, self._velocity
            for k in range(3):
                a[k] = c[0] * x[k] + c[1] * v[k] + c[2] * force[k]
                u[k] = c[3] * x[k] + c[4] * v[k] + c[5] * force[k]
            free: cython.bint = True
            if self._feels:
                free = not self._feeling.acts_at(
                    was[0] + moved[0] + a[0],
                    was[1] + moved[1] + a[1],
                    was[2] + moved[2] + a[2],
                    moved[0] / tick + u[0],
                    moved[1] / tick + u[1],
                    moved[2] / tick + u[2],
                    False,
                    self._seen,
                )
            if free:
                for k in range(3):
                    x[k], v[k] = a[k], u[k]
                return False
        self._step_in_contact(x, v, force, was, moved)
        return True

    @cython.cfunc
    @cython.exceptval(check=True)
    def _step_in_contact(
        self,
        x: cython.double[::1],
        v: cython.double[::1],
        force: cython.double[::1],
        was: cython.double[::1],
        moved: cython.double[::1],
    ) -> cython.void:
        count: cython.double = self._substeps
        part_s: cython.double = self._tick_s / count
        half: cython.double = 0.5 * part_s / _MASS_KG
        c, acting, p, u = self._in_contact, self.acting, self._place, self._velocity
        f = self._feeling
        for k in range(3):
            self.torque[k] = 0.0
            p[k] = was[k]
        for _ in range(self._substeps):
            for k in range(3):
                self.torque[k] += acting[3 + k]
                v[k] += half * acting[k]
                before = x[k]
                x[k] = c[0] * before + c[1] * v[k] + c[2] * force[k]
                v[k] = c[3] * before + c[4] * v[k] + c[5] * force[k]
                p[k] += moved[k] / count
                # Before its half kick the velocity is too slow by that, which no surface's damping must feel.
                u[k] = moved[k] / count / part_s + v[k] + half * acting[k]
            px, py, pz = p[0] + x[0], p[1] + x[1], p[2] + x[2]
            self.touches = f.acts_at(px, py, pz, u[0], u[1], u[2], True, acting)
            for k in range(3):
                v[k] += half * acting[k]
                self.torque[k] += acting[3 + k]
        for k in range(3):
            self.torque[k] *= 0.5 / count
