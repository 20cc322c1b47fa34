"""What surfaces and parts that lie do to the links of an arm, and to what it wears: tools and jaws.

What one of them feels of one surface is said in `link_forces_kernel`.

**What the arm stands in** does not count: a surface in which a link is where the robot starts, or is placed,
or where the surface is put, pushes no link until all of them have been out of it; neither does one in which
the base stands deeper than `STANDS_M`. So a table may be a plane without end. The base feels nothing. A part
that is in a link where it comes to lie pushes no link, either, before all of them have been out of it. What
begins to feel parts, as the sphere between closing jaws, does not feel one in which it is before it has been
out of that.

**Cost.** After a look at all links and surfaces nothing is looked at again until the joints have turned so
far that the nearest of them could touch; then only that is, and what is as near.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import fabs
from numpy.typing import NDArray

from iiwa_sim.contact.links_beside_kernel import NEAR_M
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.worn import PARTS, SURFACES, Worn
from iiwa_sim.robot.capsules import Capsule

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.links_beside_kernel import LinksBeside
else:
    from iiwa_sim.contact.links_beside_kernel import LinksBeside

_NEAR_M = cython.declare(cython.double, NEAR_M)
_PARTS = cython.declare(cython.int, PARTS)
# When one surface could be touched, all that are no farther from the links than this (m) are looked at.
_SOON_M = cython.declare(cython.double, 0.02)
STANDS_M = 0.02
"""A floor may reach so far into the base."""
_STANDS_M = cython.declare(cython.double, STANDS_M)


@cython.cclass
class Links(LinksBeside):
    """The capsules of one arm, and what surfaces do to them; the attributes are declared in the .pxd."""

    def __init__(self, fixed: NDArray[np.float64], capsules: Sequence[Capsule]) -> None:
        """`fixed` are the constant poses between joints, of a `Tcp` without a tool."""
        self._own = tuple(capsules)
        self._before = np.full(len(fixed) - 1, np.nan)
        self._names: Any = ()
        self._numbers: Any = {}
        self._part_count = 0
        self.begun = 0
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
        LinksBeside.__init__(self, fixed, self._own, [each.capsule for each in worn])
        self._put_on, self._put_on_levers = np.array(self._local), np.array(self._levers)
        names = list(dict.fromkeys(capsule.link for capsule in self._own))
        self._own_count = len(names)
        links = [names.index(capsule.link) for capsule in self._own]
        links += [len(names) + number for number in range(len(worn))]  # each for itself
        self._link_count = len(names) + len(worn)
        self._ends_before, self._ends_looked = np.zeros((2, self._capsule_count, 6))
        self._link = np.array(links, dtype=np.intp)
        self._share = np.array([1.0] * len(self._own) + [each.share for each in worn])
        feels = [SURFACES + PARTS] * len(self._own) + [each.feels for each in worn]
        self._feels = np.array(feels, dtype=np.intc)
        return None

    def rewear(self, worn: Sequence[Worn]) -> None:
        """What is worn, the same capsules as before, is elsewhere, or feels something else."""
        first = self._capsule_count - len(worn)
        n: cython.Py_ssize_t
        feels: cython.int
        moved: cython.double = 0.0
        for number, (capsule, feels, _share) in enumerate(worn):
            n = first + number
            if self._feels[n] != feels:
                moved = 1e9
                if self._feels[n] < _PARTS <= feels:
                    self._begin(n)
            self._feels[n] = feels
            moved = max(moved, self._carry(n, capsule.start, capsule.end))
        self._free -= moved
        self._passed += moved

    @cython.cfunc
    def _begin(self, n: cython.Py_ssize_t) -> object:
        """A capsule feels parts from now on, but none in which it is, before it has been out of that."""
        self.begun += 1
        for s in range(self._shape_count - self._part_count, self._shape_count):
            self._deaf[n, s] = 1
            self._came[n, s, 0] = self._came[n, s, 1] = self._came[n, s, 2] = 0.0
        return None

    def surround(
        self,
        surfaces: Mapping[str, Surface],
        joints: Sequence[float],
        parts: Mapping[str, Surface] | None = None,
    ) -> None:
        """Set the surfaces, and the parts that lie near, that are there from now on, with the robot at joint
        positions (rad).

        A surface of a name that was there before may have been moved.
        """
        before = self._numbers
        remembered = self._remembered() if before else ()
        lying: Any = {} if parts is None else parts
        everything = [*surfaces.values(), *lying.values()]
        self._names = (*surfaces, *lying)
        self._numbers = {name: number for number, name in enumerate(self._names)}
        self._part_count = len(lying)
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

    def shift(self, name: str, surface: Surface, way: Sequence[float]) -> None:
        """A part that lies is there now; it has gone that way, and turned by an angle: dx dy dz (m), rad."""
        s: cython.Py_ssize_t = self._numbers[name]
        r = self._shapes
        rotation, place = surface.pose
        for i in range(9):
            r[s, i] = rotation[i]
        for i in range(3):
            r[s, 9 + i] = place[i]
        for i in range(4):
            self._shifted[s, i] += way[i]
        self._free = self._away[s] = 0.0

    def leave(self, name: str, link: int, deep_m: float) -> None:
        """A link, or what is worn, by its number, is so deep in a part without pressing on it, until it is
        less deep."""
        s: cython.Py_ssize_t = self._numbers[name]
        self._unpressed[link, s] = deep_m

    def forget(self) -> None:
        """Know of no surfaces: all of them are put anew by `surround`."""
        self._names, self._shape_count, self._part_count = (), 0, 0
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
        is_part: cython.bint
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
            is_part = self._is_part(s)
            for c in range(self._capsule_count):
                if self._can_feel(c, s):
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
                        if self._deaf[c, s]:
                            self._deaf[c, s] = gap < 0.0
                            gap = max(gap, 0.0)
                        else:
                            if gap < 0.0 and is_part:
                                part = self.middle(c, s, part)
                            self._remember(c, s, gap, part)
                    else:
                        self._deaf[c, s] = 0
                    if gap < nearest:
                        nearest, where, which = gap, part, c
                if c + 1 == self._capsule_count or self._link[c + 1] != self._link[c]:
                    link = self._link[c]
                    self._unpressed[link, s] = min(self._unpressed[link, s], max(0.0, -nearest))
                    pressed: cython.double = -nearest - self._unpressed[link, s]
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
            for k in range(4):
                self._shifted[s, k] = 0.0
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
