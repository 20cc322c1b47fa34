"""What surfaces do to the TCP, tick by tick: found where it is and as fast as it comes, along its axes."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython
import numpy as np

from iiwa_sim.wrench import NO_WRENCH

if not cython.compiled:
    from iiwa_sim.contact.world_kernel import World
    from iiwa_sim.robot.arm_kernel import Tcp
else:
    from cython.cimports.iiwa_sim.contact.world_kernel import World  # type: ignore[no-redef]
    from cython.cimports.iiwa_sim.robot.arm_kernel import Tcp  # type: ignore[no-redef]


@cython.cclass
class TcpTouch:
    """The TCP of one robot in its world; the attributes are declared in the .pxd."""

    def __init__(self, world: World) -> None:
        """Nothing is felt yet; `go_to` or `be_at` say where the TCP is."""
        self.world = world
        self.known = False
        self._place, self.at = np.zeros((2, 3))
        self._turned = np.zeros(9)

    @cython.cfunc
    def go_to(self, tcp: Tcp, joints: Any) -> object:
        """The TCP is where joint positions (rad) bring it."""
        tcp.go_to(joints)
        for k in range(9):
            self._turned[k] = tcp.turned[k]
        for k in range(3):
            self.at[k] = tcp.place[k]
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def be_at(self, at: cython.double[::1]) -> cython.void:
        """The TCP is at a pose in the base: its rotation row by row, and its place (m)."""
        for k in range(9):
            self._turned[k] = at[k]
        for k in range(3):
            self.at[k] = at[9 + k]

    @cython.cfunc
    @cython.exceptval(check=False)
    def stays(self) -> cython.bint:
        """Whether the TCP is in the place of which its wrench is."""
        was, at = self._place, self.at
        return self.known and was[0] == at[0] and was[1] == at[1] and was[2] == at[2]

    @cython.cfunc
    @cython.exceptval(check=False)
    def roll(self) -> cython.void:
        """A tick has brought the TCP here: the sphere round it has rolled on what it touches."""
        self.world.roll_to(self._turned)

    @cython.cfunc
    def feel(self, tick_s: cython.double) -> object:
        """The wrench of surfaces after a tick that has brought the TCP here, or 0 s where it is put here."""
        was, at, world = self._place, self.at, self.world
        vx: cython.double = 0.0
        vy: cython.double = 0.0
        vz: cython.double = 0.0
        if self.known:
            vx, vy, vz = (at[0] - was[0]) / tick_s, (at[1] - was[1]) / tick_s, (at[2] - was[2]) / tick_s
        self.stay()
        if not world.feel_at(at[0], at[1], at[2], vx, vy, vz, tick_s > 0.0):
            return NO_WRENCH
        return self.along(world.fx, world.fy, world.fz, world.tx, world.ty, world.tz)

    @cython.cfunc
    @cython.exceptval(check=False)
    def stay(self) -> cython.void:
        """What surfaces do is known here."""
        self.known = True
        for k in range(3):
            self._place[k] = self.at[k]

    @cython.cfunc
    def along(
        self,
        fx: cython.double,
        fy: cython.double,
        fz: cython.double,
        tx: cython.double,
        ty: cython.double,
        tz: cython.double,
    ) -> object:
        """What acts, force and torque in the axes of the base, along those of the TCP."""
        if fx == 0.0 and fy == 0.0 and fz == 0.0 and tx == 0.0 and ty == 0.0 and tz == 0.0:
            return NO_WRENCH
        r = self._turned
        return (
            r[0] * fx + r[3] * fy + r[6] * fz,
            r[1] * fx + r[4] * fy + r[7] * fz,
            r[2] * fx + r[5] * fy + r[8] * fz,
            r[0] * tx + r[3] * ty + r[6] * tz,
            r[1] * tx + r[4] * ty + r[7] * tz,
            r[2] * tx + r[5] * ty + r[8] * tz,
        )
