"""The shift of the TCP off the plan by forces and surfaces: a damped mass on springs, in translation."""

from __future__ import annotations

from math import ceil

from iiwa_sim.frames import Vector
from iiwa_sim.motion.spring import Spring, damping
from iiwa_sim.motion.surroundings import LONGEST_SUBSTEP_S, NOTHING, Feel

MASS_KG = 5.0
"""Apparent mass of the TCP. Our decision: about what an iiwa's TCP weighs in the middle of its work space."""
LEAST_DAMPING_NS_PER_M = 20.0
"""Our decision: without a spring, 10 N move the TCP at 0.5 m/s. Below 40.8 N/m the ratio is above 0.7."""


class Shift:
    """Moves the shift (m) and its velocity (m/s) on, tick by tick. All vectors are in the base.

    Spring and damper are moved on exactly (`spring.py`) at any tick rate. Contact comes in by half kicks
    before and after each of its substeps (velocity Verlet), which keeps energy from growing on stiff
    surfaces.
    """

    def __init__(self, tick_s: float, feel: Feel | None) -> None:
        """`feel` is None where there is nothing to touch."""
        self._tick_s = tick_s
        self._feel = feel
        self._substeps = ceil(tick_s / LONGEST_SUBSTEP_S - 1e-9)
        self._stiffness = -1.0  # N/m, of the two springs
        self._alone = self._in_contact = Spring(MASS_KG, 0.0, LEAST_DAMPING_NS_PER_M, tick_s)
        self.touch = NOTHING
        """What surfaces do to the TCP where it is."""

    def start(self, position: Vector) -> None:
        """The TCP is at rest at a position (m)."""
        self.touch = NOTHING if self._feel is None else self._feel(position, NOTHING[0], 0.0)

    @property
    def touches(self) -> bool:
        """Whether a surface acts."""
        return self.touch != NOTHING

    def meets(self, position: Vector, moved: Vector) -> bool:
        """Whether a surface acts at a position (m), at the end of a tick of moving so far (m)."""
        if self._feel is None:
            return False
        (x, y, z), tick = moved, self._tick_s
        return self._feel(position, (x / tick, y / tick, z / tick), 0.0) != NOTHING

    def step(
        self, stiffness: float, x: Vector, v: Vector, force: Vector, was: Vector, moved: Vector
    ) -> tuple[Vector, Vector, Vector | None]:
        """Shift and velocity after a tick, and the torque (Nm) that surfaces have made in it on average, None
        where none was felt.

        The stiffness is in N/m; the force (N) is what acts besides surfaces; the plan has `moved` so far (m)
        from where it `was`.
        """
        if stiffness != self._stiffness:
            self._stiffness = stiffness
            damped = damping(MASS_KG, stiffness, LEAST_DAMPING_NS_PER_M)
            self._alone = Spring(MASS_KG, stiffness, damped, self._tick_s)
            self._in_contact = Spring(MASS_KG, stiffness, damped, self._tick_s / self._substeps)
        if not self.touches:
            step = self._alone.step
            (ax, ay, az), (ux, uy, uz) = x, v
            ax, ux = step(ax, ux, force[0])
            ay, uy = step(ay, uy, force[1])
            az, uz = step(az, uz, force[2])
            if self._feel is None or not self._touches_at((ax, ay, az), (ux, uy, uz), was, moved):
                return (ax, ay, az), (ux, uy, uz), None
        return self._step_in_contact(x, v, force, was, moved)

    def _touches_at(self, x: Vector, v: Vector, was: Vector, moved: Vector) -> bool:
        feel = self._feel
        assert feel is not None
        (wx, wy, wz), (mx, my, mz), tick = was, moved, self._tick_s
        position = (wx + mx + x[0], wy + my + x[1], wz + mz + x[2])
        velocity = (mx / tick + v[0], my / tick + v[1], mz / tick + v[2])
        return feel(position, velocity, 0.0) != NOTHING

    def _step_in_contact(
        self, shift: Vector, velocity: Vector, force: Vector, was: Vector, moved: Vector
    ) -> tuple[Vector, Vector, Vector]:
        feel, count = self._feel, self._substeps
        assert feel is not None
        part_s = self._tick_s / count
        half = 0.5 * part_s / MASS_KG
        (x, y, z), (vx, vy, vz), (wx, wy, wz) = shift, velocity, was
        mx, my, mz = moved[0] / count, moved[1] / count, moved[2] / count
        nx, ny, nz = mx / part_s, my / part_s, mz / part_s
        # `Spring.step` written out, as this runs for every part of a tick.
        xx, xv, xf, vx_x, vv, vf = self._in_contact.coefficients
        fx, fy, fz = force
        xfx, xfy, xfz, vfx, vfy, vfz = xf * fx, xf * fy, xf * fz, vf * fx, vf * fy, vf * fz
        tx = ty = tz = 0.0
        (gx, gy, gz), (px, py, pz) = self.touch
        kx, ky, kz = half * gx, half * gy, half * gz
        touch = self.touch
        for _ in range(count):
            tx, ty, tz = tx + px, ty + py, tz + pz
            vx, vy, vz = vx + kx, vy + ky, vz + kz
            x, vx = xx * x + xv * vx + xfx, vx_x * x + vv * vx + vfx
            y, vy = xx * y + xv * vy + xfy, vx_x * y + vv * vy + vfy
            z, vz = xx * z + xv * vz + xfz, vx_x * z + vv * vz + vfz
            # Before its half kick the velocity is too slow by that, which no surface's damping must feel.
            wx, wy, wz = wx + mx, wy + my, wz + mz
            touch = feel((wx + x, wy + y, wz + z), (nx + vx + kx, ny + vy + ky, nz + vz + kz), part_s)
            (gx, gy, gz), (px, py, pz) = touch
            kx, ky, kz = half * gx, half * gy, half * gz
            vx, vy, vz = vx + kx, vy + ky, vz + kz
            tx, ty, tz = tx + px, ty + py, tz + pz
        self.touch = touch
        share = 0.5 / count
        return (x, y, z), (vx, vy, vz), (share * tx, share * ty, share * tz)
