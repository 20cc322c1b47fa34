"""The shift of the TCP off the plan by forces and surfaces: a damped mass on springs, in translation."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from math import ceil
from typing import Any

import cython
import numpy as np

from iiwa_sim.frames import Vector
from iiwa_sim.motion.spring import Spring, damping
from iiwa_sim.motion.surroundings import LONGEST_SUBSTEP_S, Feel
from iiwa_sim.wrench import NO_TOUCH

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

    def __init__(self, tick_s: float, feel: Feel | None) -> None:
        """`feel` is None where there is nothing to touch."""
        self._tick_s = tick_s
        self._feel: Any = feel
        self._substeps = ceil(tick_s / LONGEST_SUBSTEP_S - 1e-9)
        self._stiffness = -1.0  # N/m, of the two springs
        self._alone = np.zeros(6)
        self._in_contact = np.zeros(6)
        self._acting = np.zeros(6)
        self.torque = np.zeros(3)
        self.touch: Any = NO_TOUCH
        self.touches = False

    @cython.cfunc
    @cython.exceptval(check=True)
    def start(self, position: Vector) -> cython.void:
        """The TCP is at rest at a position (m)."""
        self.touch = NO_TOUCH
        self.touches = False
        if self._feel is not None:
            self._touch(position[0], position[1], position[2], 0.0, 0.0, 0.0, 0.0)

    @cython.cfunc
    @cython.exceptval(-1)
    def meets(self, position: cython.double[::1], moved: cython.double[::1]) -> cython.bint:
        """Whether a surface acts at a position (m), at the end of a tick of moving so far (m)."""
        if self._feel is None:
            return False
        x, y, z = position[0], position[1], position[2]
        vx, vy, vz = moved[0] / self._tick_s, moved[1] / self._tick_s, moved[2] / self._tick_s
        return self._feel((x, y, z), (vx, vy, vz), 0.0) != NO_TOUCH

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
            self._alone = np.array(Spring(MASS_KG, stiffness, damped, self._tick_s).coefficients)
            part_s = self._tick_s / self._substeps
            self._in_contact = np.array(Spring(MASS_KG, stiffness, damped, part_s).coefficients)
        if not self.touches:
            c, tick = self._alone, self._tick_s
            ax = c[0] * x[0] + c[1] * v[0] + c[2] * force[0]
            ay = c[0] * x[1] + c[1] * v[1] + c[2] * force[1]
            az = c[0] * x[2] + c[1] * v[2] + c[2] * force[2]
            ux = c[3] * x[0] + c[4] * v[0] + c[5] * force[0]
            uy = c[3] * x[1] + c[4] * v[1] + c[5] * force[1]
            uz = c[3] * x[2] + c[4] * v[2] + c[5] * force[2]
            free: cython.bint = True
            if self._feel is not None:
                place = (was[0] + moved[0] + ax, was[1] + moved[1] + ay, was[2] + moved[2] + az)
                velocity = (moved[0] / tick + ux, moved[1] / tick + uy, moved[2] / tick + uz)
                free = self._feel(place, velocity, 0.0) == NO_TOUCH
            if free:
                x[0], x[1], x[2] = ax, ay, az
                v[0], v[1], v[2] = ux, uy, uz
                return False
        self._step_in_contact(x, v, force, was, moved)
        return True

    @cython.cfunc
    @cython.exceptval(check=True)
    def _touch(
        self,
        x: cython.double,
        y: cython.double,
        z: cython.double,
        vx: cython.double,
        vy: cython.double,
        vz: cython.double,
        dt_s: cython.double,
    ) -> cython.void:
        """Feel the world with the TCP here (m), at this velocity (m/s)."""
        acting = self._acting
        self.touch = self._feel((x, y, z), (vx, vy, vz), dt_s)
        force, torque = self.touch
        acting[0], acting[1], acting[2] = force
        acting[3], acting[4], acting[5] = torque
        self.touches = False
        for k in range(6):
            if acting[k] != 0.0:
                self.touches = True

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
        c, acting = self._in_contact, self._acting
        sx, sy, sz = x[0], x[1], x[2]
        vx, vy, vz = v[0], v[1], v[2]
        wx, wy, wz = was[0], was[1], was[2]
        mx, my, mz = moved[0] / count, moved[1] / count, moved[2] / count
        nx, ny, nz = mx / part_s, my / part_s, mz / part_s
        tx: cython.double = 0.0
        ty: cython.double = 0.0
        tz: cython.double = 0.0
        kx, ky, kz = half * acting[0], half * acting[1], half * acting[2]
        for _ in range(self._substeps):
            tx, ty, tz = tx + acting[3], ty + acting[4], tz + acting[5]
            vx, vy, vz = vx + kx, vy + ky, vz + kz
            sx, vx = c[0] * sx + c[1] * vx + c[2] * force[0], c[3] * sx + c[4] * vx + c[5] * force[0]
            sy, vy = c[0] * sy + c[1] * vy + c[2] * force[1], c[3] * sy + c[4] * vy + c[5] * force[1]
            sz, vz = c[0] * sz + c[1] * vz + c[2] * force[2], c[3] * sz + c[4] * vz + c[5] * force[2]
            # Before its half kick the velocity is too slow by that, which no surface's damping must feel.
            wx, wy, wz = wx + mx, wy + my, wz + mz
            self._touch(wx + sx, wy + sy, wz + sz, nx + vx + kx, ny + vy + ky, nz + vz + kz, part_s)
            kx, ky, kz = half * acting[0], half * acting[1], half * acting[2]
            vx, vy, vz = vx + kx, vy + ky, vz + kz
            tx, ty, tz = tx + acting[3], ty + acting[4], tz + acting[5]
        share: cython.double = 0.5 / count
        x[0], x[1], x[2] = sx, sy, sz
        v[0], v[1], v[2] = vx, vy, vz
        self.torque[0], self.torque[1], self.torque[2] = share * tx, share * ty, share * tz
