"""What surfaces do to the links of an arm, and to what it wears: tools and jaws.

What one of them feels of one surface is said in `link_forces_kernel`.

**What the arm stands in** does not count: a surface in which a link is where the robot starts, or is placed,
or where the surface is put, pushes no link until all of them have been out of it; neither does one in which
the base stands deeper than `STANDS_M`. So a table may be a plane without end. The base feels nothing.

**Cost.** After a look at all links and surfaces nothing is looked at again until the joints have turned so
far that the nearest of them could touch; then only that is, and what is as near.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt
from numpy.typing import NDArray

from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.worn import Worn
from iiwa_sim.robot.capsules import Capsule

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.link_forces_kernel import LinkForces
else:
    from iiwa_sim.contact.link_forces_kernel import LinkForces

# Distance (m) beyond which only a bound of it is found for a pair of link and surface.
_NEAR_M = cython.declare(cython.double, 0.02)
# When one surface could be touched, all that are no farther from the links than this (m) are looked at.
_SOON_M = cython.declare(cython.double, 0.02)
STANDS_M = 0.02
"""A floor may reach so far into the base."""
_STANDS_M = cython.declare(cython.double, STANDS_M)


@cython.cclass
class Links(LinkForces):
    """The capsules of one arm, and what surfaces do to them; the attributes are declared in the .pxd."""

    def __init__(self, fixed: NDArray[np.float64], capsules: Sequence[Capsule]) -> None:
        """`fixed` are the constant poses between joints, of a `Tcp` without a tool."""
        self._own = tuple(capsules)
        self._before = np.full(len(fixed) - 1, np.nan)
        self._names: Any = ()
        self._numbers: Any = {}
        self._forget_forces()
        self._wear(fixed, ())

    @cython.cfunc
    def _forget_forces(self) -> object:
        self.torques: Any = None
        self.worn: Any = None
        self.yielding_to: Any = None
        self.contacts: Any = ()
        self._free = self._passed = 0.0
        self._away = np.zeros(1)
        return None

    def wear(self, worn: Sequence[Worn]) -> None:
        """Fix this to the flange, in place of what was worn; `surround` is called before the next step."""
        self._wear(np.asarray(self._fixed), worn)

    @cython.cfunc
    def _wear(self, fixed: Any, worn: Any) -> object:
        LinkForces.__init__(self, fixed, self._own, [each.capsule for each in worn])
        self._put_on, self._put_on_levers = np.array(self._local), np.array(self._levers)
        names = list(dict.fromkeys(capsule.link for capsule in self._own))
        self._own_count = len(names)
        links = [names.index(capsule.link) for capsule in self._own]
        links += [len(names) + number for number in range(len(worn))]  # each for itself
        self._link_count = len(names) + len(worn)
        self._ends_looked = np.zeros((self._capsule_count, 6))
        self._link = np.array(links, dtype=np.intp)
        self._share = np.array([1.0] * len(self._own) + [each.share for each in worn])
        return None

    def rewear(self, worn: Sequence[Worn]) -> None:
        """What is worn, the same capsules as before, is elsewhere."""
        first = self._capsule_count - len(worn)
        moved: cython.double = 0.0
        for number, (capsule, _share) in enumerate(worn):
            moved = max(moved, self._carry(first + number, capsule.start, capsule.end))
        self._free -= moved
        self._passed += moved

    def surround(self, surfaces: Mapping[str, Surface], joints: Sequence[float]) -> None:
        """Set the surfaces that are there from now on, with the robot at joint positions (rad).

        A surface of a name that was there before may have been moved.
        """
        before = self._numbers
        remembered = self._remembered() if before else ()
        everything = list(surfaces.values())
        self._names = tuple(surfaces)
        self._numbers = {name: number for number, name in enumerate(self._names)}
        self.stand(everything)
        self._muted: Any = np.zeros(max(len(everything), 1), dtype=np.int8)
        self._away = np.zeros(max(len(everything), 1))
        laws = [(each.stiffness, each.damping, each.friction) for each in everything]
        self.part_all(self._link_count, laws)
        self.go_to(joints)
        was: cython.Py_ssize_t[::1] = np.array([before.get(name, -1) for name in self._names], dtype=np.intp)
        if before:
            self._bring(was, remembered)
        for s in range(self._shape_count):
            if was[s] < 0:
                self._muted[s] = not self._is_out(s, _STANDS_M)
        self._free = 0.0

    def forget(self) -> None:
        """Know of no surfaces: all of them are put anew by `surround`."""
        self._names, self._shape_count = (), 0
        self._numbers = {}
        self._forget_forces()

    def kept(self) -> Any:
        """What is remembered of surfaces, and what they do, to be brought back."""
        if not self._names:
            return None
        felt = self.torques, self.worn, self.yielding_to, self.contacts
        return self._names, felt, [array.copy() for array in self._remembered()]

    def restore(self, kept: Any, joints: Sequence[float]) -> None:
        """Remember that again, of surfaces that are there, with the robot at rest at `joints` (rad)."""
        for k in range(self._count):
            self._before[k] = joints[k]
        names, felt, remembered = kept
        self.torques, self.worn, self.yielding_to, self.contacts = felt
        for number, name in enumerate(self._names):
            if name in names:
                old = names.index(name)
                for array, before in zip(self._remembered(), remembered, strict=True):
                    array[:, number] = before[:, old]
        self._free = 0.0
        self._away[:] = 0.0

    @cython.ccall
    def step(self, joints: Sequence[float], tick_s: cython.double) -> None:
        """A tick has moved the robot to joint positions (rad)."""
        way: cython.double = 0.0
        known: cython.bint = True
        q: cython.double
        for k in range(self._count):
            q = joints[k]
            way += self._levers[k] * fabs(q - self._before[k])
            known = known and self._before[k] == self._before[k]
        self._free -= way
        self._passed += way
        if known and self._free > 0.0:
            for k in range(self._count):
                self._before[k] = joints[k]
            return
        self._look(joints, tick_s if known else 0.0)

    @cython.cfunc
    def _look(self, joints: Any, tick_s: cython.double) -> object:
        """Find what touches; the time is 0 where the robot has not moved here."""
        self.go_to(joints)
        least: cython.double = 1e9
        felt: list[object] = []
        made: Any = None  # joints' speeds, torques on them, those a yielding arm feels, wrench on tools
        on_links: cython.bint = False
        on_worn: cython.bint = False
        gone = self._since(self._ends_looked)
        if tick_s <= 0.0 or self._passed >= 1e9:
            gone = 1e9
        self._passed = 0.0
        e, m = self._ends, self._came
        for s in range(self._shape_count):
            self._away[s] -= gone
            least = min(least, self._away[s])
        # Surfaces that are due soon are looked at with the first: a look costs more than a surface in it.
        looks: cython.double = 0.0 if least > 0.0 else _SOON_M
        least = 1e9
        for s in range(self._shape_count):
            if self._away[s] > looks or looks == 0.0:
                least = min(least, self._away[s])
                continue
            if self._muted[s]:
                if self._is_out(s, 0.0):
                    self._muted[s] = 0
                else:
                    least = min(least, _NEAR_M)  # it is looked at again now and then
                    continue
            away: cython.double = 1e9
            nearest: cython.double = 1e9
            where: cython.double = 0.0
            which: cython.Py_ssize_t = 0
            for c in range(self._capsule_count):
                if self._moved_by[c] > 0:
                    enough: cython.double = max(0.0, min(nearest, _NEAR_M))
                    gap: cython.double = -1.0
                    part: cython.double = 0.5
                    if m[c, s, 0] == 0.0 and m[c, s, 1] == 0.0 and m[c, s, 2] == 0.0:  # as most are: first
                        ax, ay, az = e[c, 0], e[c, 1], e[c, 2]
                        dx, dy, dz = e[c, 3] - ax, e[c, 4] - ay, e[c, 5] - az
                        square = dx * dx + dy * dy + dz * dz
                        gap = self._at_least(s, ax, ay, az, dx, dy, dz, square) - self._radius[c]
                    if gap <= enough:
                        self._recall(c, s)
                        gap, part = self.gap(c, s, enough)
                        self._remember(c, s, gap, part)
                    if gap < nearest:
                        nearest, where, which = gap, part, c
                if c + 1 == self._capsule_count or self._link[c + 1] != self._link[c]:
                    link = self._link[c]
                    pressed: cython.double = -nearest
                    if pressed > 0.0 or self._pushing[link, s] > 0.0:
                        if made is None:
                            none = [0.0] * self._count
                            made = self._speeds(joints, tick_s), none, none.copy(), [0.0] * 6
                        speeds, torques, pushing, worn = made
                        contact = self._press(
                            which, s, where, pressed, speeds, tick_s, torques, pushing, worn
                        )
                        if pressed > 0.0:
                            felt.append(contact)
                            if link < self._own_count:
                                on_links = True
                            else:
                                on_worn = True
                        nearest = 0.0
                    else:
                        self._touches[link, s], self._depth[link, s] = 0, 0.0
                    away = min(away, nearest)
                    nearest = 1e9
            self._away[s] = away
            least = min(least, away)
        for k in range(self._count):
            self._before[k] = joints[k]
        self._free, self.contacts = least, tuple(felt)
        self.torques = self.worn = self.yielding_to = None
        if made is not None:
            _, torques, pushing, worn = made
            self.torques = tuple(torques) if on_links else None
            self.worn = tuple(worn) if on_worn else None
            self.yielding_to = tuple(pushing) if any(pushing) else None
        return None

    @cython.cfunc
    @cython.exceptval(-1.0, check=True)
    def _carry(self, n: cython.Py_ssize_t, start: Any, end: Any) -> cython.double:
        """A capsule that is worn has its ends there in the flange now (m); gives how far it has moved (m).
        Its levers are then no longer than when it was put on, and how far it has been from there."""
        x: cython.double
        y: cython.double
        z: cython.double
        place: cython.double
        square: cython.double
        from_there: cython.double
        row: cython.Py_ssize_t
        moved: cython.double = 0.0
        off: cython.double = 0.0
        f, local = self._fixed, self._local
        flange: cython.Py_ssize_t = self._count
        for j in range(0, 6, 3):
            x, y, z = end if j else start
            square = from_there = 0.0
            for i in range(j, j + 3):
                row = 3 * (i - j)
                place = f[flange, 9 + i - j] + (
                    f[flange, row] * x + f[flange, row + 1] * y + f[flange, row + 2] * z
                )
                square += (place - local[n, i]) * (place - local[n, i])
                from_there += (place - self._put_on[n, i]) * (place - self._put_on[n, i])
                local[n, i] = place
            moved, off = max(moved, sqrt(square)), max(off, sqrt(from_there))
        self._is_there = False
        for k in range(self._count):
            self._levers[k] = max(self._levers[k], self._put_on_levers[k] + off)
        return moved

    @cython.cfunc
    def _speeds(self, joints: Any, tick_s: cython.double) -> object:
        """Velocities of the joints (rad/s) since the last tick."""
        if tick_s <= 0.0:
            return [0.0] * self._count
        return [(joints[k] - self._before[k]) / tick_s for k in range(self._count)]

    @cython.cfunc
    @cython.exceptval(check=False)
    def _since(self, before: cython.double[:, ::1]) -> cython.double:
        """No point of the arm is farther (m) from where it was with the ends of capsules there; those of now
        are put there."""
        e, b = self._ends, before
        most: cython.double = 0.0
        for c in range(self._capsule_count):
            for j in range(0, 6, 3):
                dx, dy, dz = e[c, j] - b[c, j], e[c, j + 1] - b[c, j + 1], e[c, j + 2] - b[c, j + 2]
                most = max(most, dx * dx + dy * dy + dz * dz)
                for i in range(3):
                    b[c, j + i] = e[c, j + i]
        return sqrt(most)

    @cython.cfunc
    def _bring(self, was: cython.Py_ssize_t[::1], remembered: Any) -> object:
        """Remember of each surface what was remembered of the one of that number; -1 for a new one."""
        muted: cython.char[:, ::1]
        came: cython.double[:, :, ::1]
        pushing: cython.double[:, ::1]
        depth: cython.double[:, ::1]
        touches: cython.char[:, ::1]
        rubbed: cython.double[:, :, ::1]
        dragging: cython.double[:, :, ::1]
        muted, came, pushing, depth, touches, rubbed, dragging = remembered
        o: cython.Py_ssize_t
        capsules: cython.Py_ssize_t = min(came.shape[0], self._came.shape[0])  # fewer or more than before
        links: cython.Py_ssize_t = min(depth.shape[0], self._depth.shape[0])
        for s in range(was.shape[0]):
            o = was[s]
            if o < 0:
                continue
            self._muted[s] = muted[0, o]
            for c in range(capsules):
                for k in range(3):
                    self._came[c, s, k] = came[c, o, k]
            for m in range(links):
                self._pushing[m, s], self._depth[m, s] = pushing[m, o], depth[m, o]
                self._touches[m, s] = touches[m, o]
                for k in range(3):
                    self._rubbed[m, s, k] = rubbed[m, o, k]
                    self._dragging[m, s, k] = dragging[m, o, k]
        return None

    @cython.cfunc
    def _remembered(self) -> object:
        """All that is remembered of surfaces, as arrays: the second index is that of the surface."""
        muted: Any = np.asarray(self._muted)
        return (
            muted[np.newaxis],
            np.asarray(self._came),
            np.asarray(self._pushing),
            np.asarray(self._depth),
            np.asarray(self._touches),
            np.asarray(self._rubbed),
            np.asarray(self._dragging),
        )

    @cython.cfunc
    def _is_out(self, s: cython.Py_ssize_t, base_m: cython.double) -> cython.bint:
        """Whether no link is in a surface, and the base not deeper than so."""
        for c in range(self._capsule_count):
            self._recall(c, s)
            if self.gap(c, s, _NEAR_M)[0] < (-base_m if self._moved_by[c] == 0 else 0.0):
                return False
        return True
