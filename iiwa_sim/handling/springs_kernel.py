"""What is in the springs at which a part that is held presses on others."""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from typing import Any

import cython
import numpy as np

from iiwa_sim.handling.part import Part

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.world_kernel import World
    from cython.cimports.iiwa_sim.handling.near_kernel import Near
else:
    from iiwa_sim.contact.world_kernel import World
    from iiwa_sim.handling.near_kernel import Near


@cython.cclass
class Springs(Near):
    """The springs of its own points in surfaces, and of corners of others in it; the attributes are declared
    in the .pxd."""

    def __init__(self, part: Part, upright: bool) -> None:
        """Begin with a part that presses nowhere; a cylinder that is `upright` touches with its rims."""
        Near.__init__(self, part, upright)
        self._least_of: Any = None
        self._least = 1.0
        self._besides: Any = ()
        self._found_at = np.zeros(3)

    @cython.cfunc
    def _press(self, pose: cython.double[::1], besides: Any) -> object:
        """Note the springs of corners of others, found with the part at that pose."""
        self._besides = besides
        for k in range(3):
            self._found_at[k] = pose[9 + k]
        return None

    @cython.cfunc
    @cython.exceptval(-1.0, check=True)
    def stored_at(self, pose: cython.double[::1]) -> cython.double:
        """What would be in its springs (J) at a pose close to the last one; nothing remembers that."""
        soft: cython.double = 0.0
        n: cython.Py_ssize_t
        world: World
        p, own = pose, self._own
        if self._least_of is not self._near:
            self._least_of = self._near
            self._least = min([each.stiffness for each in self._near.values()], default=1.0)
        for point, world in self.worlds.items():
            n = point
            x: cython.double = (p[0] * own[n, 0] + p[1] * own[n, 1] + p[2] * own[n, 2]) + p[9]
            y: cython.double = (p[3] * own[n, 0] + p[4] * own[n, 1] + p[5] * own[n, 2]) + p[10]
            z: cython.double = (p[6] * own[n, 0] + p[7] * own[n, 1] + p[8] * own[n, 2]) + p[11]
            if world.feel_at(x, y, z, 0.0, 0.0, 0.0, False):
                fx, fy, fz = world.fx, world.fy, world.fz
                if fx != 0.0 or fy != 0.0 or fz != 0.0:
                    soft += (fx * fx + fy * fy + fz * fz) / self._least
        for each in self._besides:
            soft += self._in_one(each, p[9], p[10], p[11])
        return 0.5 * soft

    @cython.cfunc
    @cython.exceptval(-1.0, check=True)
    def _in_one(self, spring: Any, x: cython.double, y: cython.double, z: cython.double) -> cython.double:
        """Twice what would be in the spring of a corner (J) with the middle of the part at that place (m)."""
        stiffness: cython.double
        depth: cython.double
        nx: cython.double
        ny: cython.double
        nz: cython.double
        stiffness, depth, (nx, ny, nz) = spring
        at = self._found_at
        depth += nx * (x - at[0]) + ny * (y - at[1]) + nz * (z - at[2])
        return stiffness * depth * depth if depth > 0.0 else 0.0
