"""The world the TCP touches: surfaces, and a sphere round it that touches them.

What one surface does is said in `contact_kernel`: how it pushes, holds, and lets go.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import cython
import numpy as np

from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Rotation, Transform, Vector
from iiwa_sim.wrench import NO_TOUCH, Touch

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.contact_kernel import Contact, turn_between
    from cython.cimports.iiwa_sim.robot.feeling_kernel import Feeling
else:
    from iiwa_sim.contact.contact_kernel import Contact, turn_between
    from iiwa_sim.robot.feeling_kernel import Feeling


@cython.cclass
class World(Feeling):
    """Surfaces, and a sphere round the TCP that touches them, and rolls on them.

    Each surface acts for itself: where two overlap, or meet flush, their forces add up. The attributes are
    declared in the .pxd.
    """

    def __init__(self, surfaces: Iterable[Surface], radius_m: float) -> None:
        """`radius_m` is that of the sphere; 0 makes it a point. Each surface has a name of its own."""
        self.radius_m = radius_m
        self.changes = 0
        self._contacts: dict[str, Contact] = {}
        self._all: list[Contact] = []
        self._turned, self._coming = np.zeros((2, 9))
        self._is_turned = False
        for surface in surfaces:
            self.put(surface)

    @property
    def surfaces(self) -> dict[str, Surface]:
        """The surfaces by their names."""
        return {name: contact.surface for name, contact in self._contacts.items()}

    def put(self, surface: Surface) -> None:
        """Add a surface, or have it take the place of the one of its name, as one not touched before."""
        self._contacts[surface.name] = Contact(surface, self.radius_m)
        self._all = list(self._contacts.values())
        self.changes += 1

    def move(self, name: str, pose: Transform) -> None:
        """Move a surface, which must be there; a TCP that touches it goes on doing so if it still can."""
        contact = self._contacts[name]
        contact.move(contact.surface._replace(pose=pose))
        self.changes += 1

    def touched(self, name: str) -> bool:
        """Whether a surface, which must be there, was touched where the TCP has been last."""
        return bool(self._contacts[name].touched)

    def roll(self, rotation: Rotation) -> None:
        """The TCP is turned like that in the base now, and has turned since the last call, by little."""
        for k in range(9):
            self._coming[k] = rotation[k]
        self.roll_to(self._coming)

    @cython.cfunc
    @cython.exceptval(check=False)
    def roll_to(self, rotation: cython.double[::1]) -> cython.void:
        """`roll` for an array."""
        before = self._turned
        turns: cython.bint = False
        for k in range(9):
            turns = turns or before[k] != rotation[k]
        if self._is_turned and turns:
            wx, wy, wz = turn_between(before, rotation)
            contact: Contact
            for contact in self._all:
                contact.roll(wx, wy, wz)
        self._is_turned = True
        for k in range(9):
            before[k] = rotation[k]

    def remove(self, name: str) -> None:
        """Take a surface away, which must be there."""
        del self._contacts[name]
        self._all = list(self._contacts.values())
        self.changes += 1

    def forget(self) -> None:
        """No surface has been touched before."""
        for surface in self.surfaces.values():
            self.put(surface)

    def memory(self) -> Any:
        """What all surfaces that it touches remember of the TCP, to be compared."""
        return [contact.memory() for contact in self._all if contact.touched]

    def kept(self) -> Any:
        """What all surfaces remember of the TCP, by their names, to be brought back."""
        turned = tuple(np.asarray(self._turned).tolist()) if self._is_turned else None
        return turned, {name: contact.kept() for name, contact in self._contacts.items()}

    def restore(self, kept: Any) -> None:
        """Remember that again, of surfaces that are there."""
        turned, contacts = kept
        self._is_turned = turned is not None
        if turned is not None:
            for k in range(9):
                self._turned[k] = turned[k]
        for name, memory in contacts.items():
            if name in self._contacts:
                self._contacts[name].restore(memory)

    @property
    def empty(self) -> bool:
        """Whether there is nothing to touch."""
        return not self._contacts

    def feel(self, position: Vector, velocity: Vector, dt_s: float) -> Touch:
        """What is felt with the TCP at a position (m) and a velocity (m/s), in the base.

        Friction remembers that the TCP has been here; with a time `dt_s` of 0 it does not. In free space all
        is exactly 0.
        """
        px: cython.double
        py: cython.double
        pz: cython.double
        vx: cython.double
        vy: cython.double
        vz: cython.double
        px, py, pz = position
        vx, vy, vz = velocity
        if not self.feel_at(px, py, pz, vx, vy, vz, dt_s > 0.0):
            return NO_TOUCH
        felt: Touch = Touch((self.fx, self.fy, self.fz), (self.tx, self.ty, self.tz))
        return felt

    @cython.ccall
    @cython.exceptval(-1, check=True)
    def feel_at(
        self,
        px: cython.double,
        py: cython.double,
        pz: cython.double,
        vx: cython.double,
        vy: cython.double,
        vz: cython.double,
        remember: cython.bint,
    ) -> cython.bint:
        """`feel` for numbers: whether a surface touches the TCP; what they do is in f, t."""
        touched: cython.bint = False
        fx = fy = fz = tx = ty = tz = 0.0
        contact: Contact
        for contact in self._all:
            if contact.press(px, py, pz, vx, vy, vz, remember):
                touched = True
                fx, fy, fz = fx + contact.fx, fy + contact.fy, fz + contact.fz
                tx, ty, tz = tx + contact.tx, ty + contact.ty, tz + contact.tz
        self.fx, self.fy, self.fz, self.tx, self.ty, self.tz = fx, fy, fz, tx, ty, tz
        return touched
