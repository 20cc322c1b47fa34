"""What surfaces do to a part that is held: at its corners, its rims, or as spheres.

**Cost.** Surfaces are looked for when the part has gone `NEAR_M`; of those that are near, the distances of
its points are measured, and none is looked at again before one of them could touch.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import sqrt

from iiwa_sim.contact.crowd import Spring
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Transform, Vector
from iiwa_sim.handling.near_kernel import NEAR_M
from iiwa_sim.handling.part import LEVEL, Part

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.at_tcp_kernel import farthest, take
    from cython.cimports.iiwa_sim.contact.contact_kernel import Contact
    from cython.cimports.iiwa_sim.contact.world_kernel import World
    from cython.cimports.iiwa_sim.handling.over_kernel import Over
    from cython.cimports.iiwa_sim.handling.springs_kernel import Springs
else:
    from iiwa_sim.contact.at_tcp_kernel import farthest, take
    from iiwa_sim.contact.contact_kernel import Contact
    from iiwa_sim.contact.world_kernel import World
    from iiwa_sim.handling.over_kernel import Over
    from iiwa_sim.handling.springs_kernel import Springs

_NEAR = cython.declare(cython.double, NEAR_M)


@cython.cclass
class Touching(Springs):
    """What acts on one part, tick by tick; the attributes are declared in the .pxd."""

    def __init__(self, part: Part, upright: bool) -> None:
        """Begin with a part that has touched nothing; a cylinder that is `upright` touches with its rims."""
        Springs.__init__(self, part, upright)
        self._pose = np.zeros(12)
        self._was = np.zeros((len(self._own), 3))
        self.besides: tuple[Vector, Vector, list[Spring]] | None = None
        self._leaning: Any = set()
        self._unpressed: list[tuple[int, str, float]] = []
        self.forget()

    @property
    def force(self) -> Vector:
        """What acts on it (N), in base axes."""
        return (self.fx, self.fy, self.fz)

    @property
    def torque(self) -> Vector:
        """The torque about its middle (Nm), in base axes."""
        return (self.tx, self.ty, self.tz)

    @property
    def pushed(self) -> bool:
        """Whether anything has pushed it in the last tick."""
        return bool(self.is_pushed())

    @cython.cfunc
    @cython.exceptval(check=False)
    def is_pushed(self) -> cython.bint:
        """`pushed` for kernels."""
        return self.fx != 0.0 or self.fy != 0.0 or self.fz != 0.0

    def look_again(self) -> None:
        """Surfaces may have come, moved or gone."""
        self._has_looked, self._free = False, 0.0

    def leave(self, unpressed: Mapping[tuple[int, int], float], names: Sequence[str]) -> None:
        """Have so much (m) of how deep a point is in a part press nothing, by the part's number among `names`
        and the point's: it has come there otherwise than by being pressed in."""
        if unpressed:
            self._unpressed = [(point, names[part], deep) for (part, point), deep in unpressed.items()]
            self._free = 0.0

    def at(self, name: str, pose: Transform) -> dict[int, tuple[Vector, Any, Vector | None]]:
        """The part is at a pose now, which is remembered: by the number of each point that is close to a
        surface of this name, where it touches that (m, in the base), by which contact, and how far it is from
        where friction has held it there, None where that has not."""
        take(pose, self._pose)
        p, own, found = self._pose, self._own, {}
        self._lean(p, name)
        n: cython.Py_ssize_t
        world: World
        contact: Contact
        for point, world in self.worlds.items():
            if name not in world._contacts:
                continue
            n, contact = point, world._contacts[name]
            x: cython.double = (p[0] * own[n, 0] + p[1] * own[n, 1] + p[2] * own[n, 2]) + p[9]
            y: cython.double = (p[3] * own[n, 0] + p[4] * own[n, 1] + p[5] * own[n, 2]) + p[10]
            z: cython.double = (p[6] * own[n, 0] + p[7] * own[n, 1] + p[8] * own[n, 2]) + p[11]
            if contact._leans:
                x, y = contact._lean_x, contact._lean_y
            found[point] = ((x, y, z), *world.at(name, (x, y, z)))
        return found

    @cython.cfunc
    def _lean(self, pose: cython.double[::1], name: Any) -> object:
        """Have points beside a surface of this name, or any for None, press where the part is over that."""
        s: cython.Py_ssize_t
        n: cython.Py_ssize_t
        world: World
        contact: Contact
        over: Over = self._over
        if self._is_over:
            over.put(pose)
        for s, each in enumerate(self._near if self._is_over else ()):
            if name is not None and name != each:
                continue
            over.face(self._shapes[s], self._kinds[s])
            if over.is_apart() and each not in self._leaning:
                continue
            for point, world in self.worlds.items():
                n = point
                contact = world._contacts[each]
                # What comes in from beside presses only on its sides.
                leans: cython.bint = contact._leans or over.is_above(n) or contact.is_from_above()
                leans = leans and over.is_over(n)
                if leans or contact._leans:
                    contact.lean(leans, over.x, over.y)
                    self._leaning.add(each)
        return None

    def slides(self) -> None:
        """Note that the part goes some way that `passes` is not told of."""
        self._free = 0.0

    def forget(self) -> None:
        """Forget what was touched: the part has been put somewhere else."""
        self._has_looked = self._has_measured = False
        self._free = 0.0
        self.worlds: Any = {}
        self._is_over = False
        self._has_been[:] = 0
        self.fx = self.fy = self.fz = self.tx = self.ty = self.tz = 0.0

    def pressed_from_above(self, name: str) -> bool:
        """Whether a surface of this name pushes it straight up, where it has been last."""
        worlds = [each for each in self.worlds.values() if name in each.surfaces]
        return any(each.touched(name) and each.outward(name)[2] > 1.0 - LEVEL for each in worlds)

    def memory(self) -> object:
        """What surfaces remember of it, to be compared."""
        return [world.memory() for world in self.worlds.values()]

    def kept(self) -> object:
        """All that it remembers, to be brought back."""
        worlds = {point: world.kept() for point, world in self.worlds.items()}
        looked = tuple(self._looked) if self._has_looked else None
        measured = tuple(self._measured) if self._has_measured else None
        places = np.array(self._was), np.array(self._has_been), looked, measured, self._known, self._is_over
        return worlds, dict(self._near), places, self.force, self.torque

    def restore(self, kept: Any) -> None:
        """Remember that again, among the same surfaces."""
        worlds, near, places, force, torque = kept
        was, has_been, looked, measured, self._known, self._is_over = places
        self.fx, self.fy, self.fz = force
        self.tx, self.ty, self.tz = torque
        self._was = was.copy()
        self._has_been: Any = has_been.copy()
        self._has_looked, self._has_measured = looked is not None, measured is not None
        if looked is not None:
            self._looked = np.array(looked)
        if measured is not None:
            self._measured = np.array(measured)
        self._take_near(dict(near))
        self._leaning = set(near)
        self.worlds, self._free = {}, 0.0
        for point, memory in worlds.items():
            world = self.worlds[point] = World(self._near.values(), self._radius)
            world.restore(memory)

    @cython.cfunc
    @cython.exceptval(check=False)
    def passes(self, way_m: cython.double) -> cython.bint:
        """A tick has brought no point of it farther than that: whether that is all, and `go_to` has nothing
        to do: it touches nothing, and nothing is to be looked for."""
        self._free -= way_m
        return self._free > 0.0 and self.besides is None

    def step(self, pose: Transform, surfaces: Callable[[], Sequence[Surface]], tick_s: float) -> None:
        """A tick has brought it to `pose`; the surfaces that there are are asked for now and then."""
        take(pose, self._pose)
        self.go_to(self._pose, surfaces, tick_s)

    def come_down(
        self, pose: Transform, rise_m: float, surfaces: Callable[[], Sequence[Surface]], tick_s: float
    ) -> None:
        """The part has been at a pose until now, so far (m) below the face on which it lies: it has come to
        that from above, also where a corner is nearer to a side. In others it is that deep unpressed."""
        world: World
        contact: Contact
        take(pose, self._pose)
        self._pose[11] += rise_m
        self.go_to(self._pose, surfaces, tick_s)
        for world in self.worlds.values():
            for contact in world._all:
                contact.unpressed = max(0.0, contact._depth)
        self._has_been[:] = 0
        self._free = 0.0

    @cython.cfunc
    def go_to(self, pose: cython.double[::1], surfaces: Any, tick_s: cython.double) -> object:
        """`step` for an array: rotation, row by row, and place."""
        gone: cython.double = 0.0
        turned: cython.double = 0.0
        x, y, z = pose[9], pose[10], pose[11]
        if self._has_looked:
            at = self._looked
            gone = sqrt((x - at[0]) * (x - at[0]) + (y - at[1]) * (y - at[1]) + (z - at[2]) * (z - at[2]))
        if not self._has_looked or gone > _NEAR:
            if self._look(x, y, z, surfaces()):
                self._has_measured = False
            gone = 0.0
        if self._has_measured:
            turned = farthest(self._measured, pose, self._extent)
        if not self._has_measured or turned > self._known:
            self._measure(pose)
            turned = 0.0
        self._free = 0.0
        self._press(pose, () if self.besides is None else self.besides[2])
        if not self.worlds and self.besides is None:
            self.fx = self.fy = self.fz = self.tx = self.ty = self.tz = 0.0
            self._free = min(_NEAR - gone, self._known - turned)
            return None
        return self._feel(pose, tick_s)

    @cython.cfunc
    def _feel(self, pose: cython.double[::1], tick_s: cython.double) -> object:
        """Find what acts on it: what surfaces do to its points, and what else does."""
        fx: cython.double = 0.0
        fy: cython.double = 0.0
        fz: cython.double = 0.0
        tx: cython.double = 0.0
        ty: cython.double = 0.0
        tz: cython.double = 0.0
        if self.besides is not None:
            force, torque, _ = self.besides
            fx, fy, fz = force
            tx, ty, tz = torque
        n: cython.Py_ssize_t
        world: World
        for point, name, deep in self._unpressed:
            if point in self.worlds:
                self.worlds[point].leave(name, deep)
        self._unpressed = []
        self._lean(pose, None)
        p, own, was = pose, self._own, self._was
        for point, world in self.worlds.items():
            n = point
            if self._radius > 0.0:
                world.roll_to(pose)
            px: cython.double = (p[0] * own[n, 0] + p[1] * own[n, 1] + p[2] * own[n, 2]) + p[9]
            py: cython.double = (p[3] * own[n, 0] + p[4] * own[n, 1] + p[5] * own[n, 2]) + p[10]
            pz: cython.double = (p[6] * own[n, 0] + p[7] * own[n, 1] + p[8] * own[n, 2]) + p[11]
            vx: cython.double = 0.0
            vy: cython.double = 0.0
            vz: cython.double = 0.0
            if self._has_been[n]:
                vx, vy, vz = (px - was[n, 0]) / tick_s, (py - was[n, 1]) / tick_s, (pz - was[n, 2]) / tick_s
            self._has_been[n] = 1
            was[n, 0], was[n, 1], was[n, 2] = px, py, pz
            if not world.feel_at(px, py, pz, vx, vy, vz, tick_s > 0.0):
                continue
            x, y, z = px - p[9], py - p[10], pz - p[11]
            fx, fy, fz = fx + world.fx, fy + world.fy, fz + world.fz
            tx += world.tx + y * world.fz - z * world.fy
            ty += world.ty + z * world.fx - x * world.fz
            tz += world.tz + x * world.fy - y * world.fx
        self.fx, self.fy, self.fz, self.tx, self.ty, self.tz = fx, fy, fz, tx, ty, tz
        return None
