"""What surfaces and parts that lie do to the links of an arm, and to what it wears: tools and jaws.

**What a link feels.** A surface pushes the point of a link that is deepest in it with its stiffness times the
depth, damped as at the TCP, straight out to its nearest point; that makes torques on the joints that move
the link. It is not remembered by which way a link has come in. What tools and jaws feel makes a wrench at the
TCP.

**Friction.** What a link has gone along the surface winds a spring, whose force is at most the friction times
the normal force; what is beyond that is lost. It is unwound by going back, and gone where the link leaves the
surface. It is as stiff as the surface, up to `_STIFFEST`.

**What the arm stands in** does not count: a surface in which a link is where the robot starts, or is placed,
or where the surface is put, pushes no link until all of them have been out of it; neither does one in which
the base stands deeper than `STANDS_M`. So a table may be a plane without end. The base feels nothing. A part
that is in a link where it comes to lie pushes no link, either, before all of them have been out of it.

**A robot that yields** gives way to the same forces, but for what keeps it calm at any tick: the force is the
one that the surface will have at the end of the next tick, if the link has the least mass that it can have
there, and if what else pushes it goes on as it has on the average of the last ticks. At rest it is the same.

**Cost.** After a look at all links and surfaces nothing is looked at again until the joints have turned so
far that the nearest of them could touch.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt
from numpy.typing import NDArray

from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Vector
from iiwa_sim.robot.capsules import Capsule

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.capsules_kernel import Capsules
else:
    from iiwa_sim.contact.capsules_kernel import Capsules

# Of a pair that is farther apart (m) only a bound of the distance is found.
_NEAR_M = cython.declare(cython.double, 0.02)
# No arm that yields has a smaller moment of inertia about a joint (kg m^2), but near singular poses: as
# `motion/compliance_kernel.py` has it; a held one has more.
_LEAST_INERTIA = cython.declare(cython.double, 0.2)
# Part by which the average of a push follows it in a tick.
_FOLLOWS = cython.declare(cython.double, 0.1)
# Friction's spring on a link is no stiffer (N/m): a robot that yields would swing on it.
STIFFEST_N_PER_M = 5e3
_STIFFEST = cython.declare(cython.double, STIFFEST_N_PER_M)
# A smaller average (N) of a link that touches nothing is none.
_LEAST_PUSH_N = cython.declare(cython.double, 1e-3)
STANDS_M = 0.02
"""A floor may reach so far into the base."""
_STANDS_M = cython.declare(cython.double, STANDS_M)
SURFACES, PARTS = 1, 2
"""What a capsule can feel; the sum for both."""
_PARTS = cython.declare(cython.int, PARTS)


class LinkContact(NamedTuple):
    """A link that touches a surface, or a part."""

    link: str
    surface: str
    point: Vector
    """Of the link, where the surface acts (m, in the base)."""
    force: Vector
    """N, in the base, acting on the robot."""


class Worn(NamedTuple):
    """A capsule that is fixed to the flange."""

    capsule: Capsule
    """As in the flange."""
    feels: int
    """Of `SURFACES` and `PARTS`; 0 for nothing now."""
    share: float = 1.0
    """What it feels of a surface's stiffness: with others side by side a part of it."""


class Ball(NamedTuple):
    """Of a link, or of what the arm wears, the ball that is nearest to a part."""

    middle: Vector
    """m, in the base"""
    radius: float
    """m"""
    rubbed: Vector
    """How far (m, in the base) it has gone along the part, as far as friction holds that."""
    share: float
    """What it feels of the part's stiffness."""


@cython.cclass
class Links(Capsules):
    """The capsules of one arm, and what surfaces do to them."""

    torques: Any = cython.declare(object, visibility="readonly")
    """Torque (Nm) on each joint; None where no link touches anything."""
    worn: Any = cython.declare(object, visibility="readonly")
    """Force (N), and torque (Nm) about the origin, in the base, on what the arm wears; None for nothing."""
    yielding_to: Any = cython.declare(object, visibility="readonly")
    """Torque (Nm) on each joint that a yielding robot gives way to; None where no link touches anything."""
    contacts: Any = cython.declare(object, visibility="readonly")
    """Tuple of `LinkContact`."""
    _own: Any  # capsules of the arm without what it wears
    _own_count: cython.Py_ssize_t  # links of the arm
    _link_count: cython.Py_ssize_t
    _link: cython.Py_ssize_t[::1]  # of each capsule: the number of its link
    _feels: cython.int[::1]
    _share: cython.double[::1]
    _names: Any
    _part_count: cython.Py_ssize_t
    _law: cython.double[:, ::1]  # of each surface: stiffness, damping, friction
    _muted: cython.char[::1]  # surfaces that push no link
    _pushing: cython.double[:, ::1]  # force (N) on a link of a robot that yields, on the average
    # Of each link and surface: whether they touched, and how far friction's spring is wound (m, in the base).
    _touches: cython.char[:, ::1]
    _rubbed: cython.double[:, :, ::1]
    _dragging: cython.double[:, :, ::1]  # friction (N) on a link of a robot that yields, on the average
    # Of each part: how it has been moved since links have felt it: a way (m), an angle about z (rad).
    _shifted: cython.double[:, ::1]
    _ends_before: cython.double[:, ::1]  # when `goes` was asked last
    _free: cython.double  # way (m) that any point of the arm can go before a link could touch something
    _before: cython.double[::1]  # joint positions of the last tick (rad)

    def __init__(self, fixed: NDArray[np.float64], capsules: Sequence[Capsule]) -> None:
        """`fixed` are the constant poses between joints, of a `Tcp` without a tool."""
        self._own = tuple(capsules)
        self._before = np.full(len(fixed) - 1, np.nan)
        self._names: Any = ()
        self._part_count = 0
        self._forget_forces()
        self._wear(fixed, ())

    @cython.cfunc
    def _forget_forces(self) -> object:
        self.torques: Any = None
        self.worn: Any = None
        self.yielding_to: Any = None
        self.contacts: Any = ()
        self._free = 0.0
        return None

    def wear(self, worn: Sequence[Worn]) -> None:
        """From now on this is fixed to the flange; `surround` is called before the next step."""
        self._wear(np.asarray(self._fixed), worn)

    @cython.cfunc
    def _wear(self, fixed: Any, worn: Any) -> object:
        Capsules.__init__(self, fixed, self._own, [each.capsule for each in worn])
        names = list(dict.fromkeys(capsule.link for capsule in self._own))
        self._own_count = len(names)
        links = [names.index(capsule.link) for capsule in self._own]
        links += [len(names) + number for number in range(len(worn))]  # each for itself
        self._link_count = len(names) + len(worn)
        self._ends_before = np.zeros((self._capsule_count, 6))
        self._link = np.array(links, dtype=np.intp)
        self._share = np.array([1.0] * len(self._own) + [each.share for each in worn])
        feels = [SURFACES + PARTS] * len(self._own) + [each.feels for each in worn]
        self._feels = np.array(feels, dtype=np.intc)
        return None

    def rewear(self, worn: Sequence[Worn]) -> None:
        """What is worn, the same capsules as before, is elsewhere, or feels something else."""
        first = self._capsule_count - len(worn)
        f, local = self._fixed, self._local
        n: cython.Py_ssize_t
        for number, each in enumerate(worn):
            n = first + number
            self._feels[n] = each.feels
            for j, end in ((0, each.capsule.start), (3, each.capsule.end)):
                x, y, z = end
                for i in range(3):
                    local[n, j + i] = f[self._count, 9 + i] + (
                        f[self._count, 3 * i] * x
                        + f[self._count, 3 * i + 1] * y
                        + f[self._count, 3 * i + 2] * z
                    )
        self._free = 0.0

    def surround(
        self,
        surfaces: Mapping[str, Surface],
        joints: Sequence[float],
        parts: Mapping[str, Surface] | None = None,
    ) -> None:
        """These are the surfaces, and the parts that lie near, from now on, and the robot is at joint
        positions (rad).

        A surface of a name that was there before may have been moved.
        """
        before = {name: number for number, name in enumerate(self._names)}
        muted: Any = self._muted if before else None
        pushing: Any = self._pushing if before else None
        touches: Any = self._touches if before else None
        rubbed: Any = self._rubbed if before else None
        dragging: Any = self._dragging if before else None
        lying: Any = {} if parts is None else parts
        everything = [*surfaces.values(), *lying.values()]
        self._names = (*surfaces, *lying)
        self._part_count = len(lying)
        self.stand(everything)
        laws = [(each.stiffness, each.damping, each.friction) for each in everything]
        self._law = np.array(laws).reshape(len(laws), 3)
        least = max(len(laws), 1)
        self._muted = np.zeros(least, dtype=np.int8)
        self._pushing = np.zeros((self._link_count, least))
        self._touches = np.zeros((self._link_count, least), dtype=np.int8)
        self._rubbed = np.zeros((self._link_count, least, 3))
        self._dragging = np.zeros((self._link_count, least, 3))
        self._shifted = np.zeros((least, 4))
        self.go_to(joints)
        old: cython.Py_ssize_t
        for s in range(self._shape_count):
            old = before.get(self._names[s], -1)
            if old < 0:
                self._muted[s] = not self._is_out(s, _STANDS_M)
                continue
            self._muted[s] = muted[old]
            for c in range(min(self._link_count, len(pushing))):
                self._pushing[c, s], self._touches[c, s] = pushing[c, old], touches[c, old]
                for i in range(3):
                    self._rubbed[c, s, i], self._dragging[c, s, i] = rubbed[c, old, i], dragging[c, old, i]
        self._free = 0.0

    def shift(self, name: str, surface: Surface, way: Sequence[float]) -> None:
        """A part that lies is there now; it has gone that way, and turned by an angle: dx dy dz (m), rad."""
        s: cython.Py_ssize_t = self._names.index(name)
        r = self._shapes
        rotation, place = surface.pose
        for i in range(9):
            r[s, i] = rotation[i]
        for i in range(3):
            r[s, 9 + i] = place[i]
        for i in range(4):
            self._shifted[s, i] += way[i]
        self._free = 0.0

    def forget(self) -> None:
        """Know of no surfaces: all of them are put anew by `surround`."""
        self._names, self._shape_count, self._part_count = (), 0, 0
        self._forget_forces()

    def kept(self) -> Any:
        """What is remembered of surfaces, to be brought back."""
        if not self._names:
            return None
        forces = np.array(self._pushing), np.array(self._rubbed), np.array(self._dragging)
        return self._names, np.array(self._muted), np.array(self._touches), forces

    def restore(self, kept: Any, joints: Sequence[float]) -> None:
        """Remember that again, of surfaces that are there, with the robot at rest at `joints` (rad)."""
        for k in range(self._count):
            self._before[k] = joints[k]
        names, muted, touches, forces = kept
        pushing, rubbed, dragging = forces
        were: Any = np.asarray(self._muted)
        touch: Any = np.asarray(self._touches)
        now: Any = (np.asarray(self._pushing), np.asarray(self._rubbed), np.asarray(self._dragging))
        for number, name in enumerate(self._names):
            if name in names:
                old = names.index(name)
                were[number] = muted[old]
                touch[:, number] = touches[:, old]
                for array, before in zip(now, (pushing, rubbed, dragging), strict=True):
                    array[:, number] = before[:, old]
        self._free = 0.0

    def step(self, joints: Sequence[float], tick_s: float) -> None:
        """A tick has moved the robot to joint positions (rad)."""
        way: cython.double = 0.0
        known: cython.bint = True
        q: cython.double
        for k in range(self._count):
            q = joints[k]
            way += self._levers[k] * fabs(q - self._before[k])
            known = known and self._before[k] == self._before[k]
        self._free -= way
        if known and self._free > 0.0:
            for k in range(self._count):
                self._before[k] = joints[k]
            return
        self._look(joints, tick_s if known else 0.0)

    @cython.cfunc
    def _speeds(self, joints: Any, tick_s: cython.double) -> object:
        """Of the joints (rad/s) since the last tick."""
        if tick_s <= 0.0:
            return [0.0] * self._count
        return [(joints[k] - self._before[k]) / tick_s for k in range(self._count)]

    @cython.cfunc
    def _look(self, joints: Any, tick_s: cython.double) -> object:
        """Find what touches; the time is 0 where the robot has not moved here."""
        self.go_to(joints)
        speeds = self._speeds(joints, tick_s)
        for k in range(self._count):
            self._before[k] = joints[k]
        least: cython.double = 1e9
        felt = []
        torques = [0.0] * self._count
        pushing = [0.0] * self._count
        worn = [0.0] * 6
        on_links: cython.bint = False
        on_worn: cython.bint = False
        for s in range(self._shape_count):
            if self._muted[s]:
                if self._is_out(s, 0.0):
                    self._muted[s] = 0
                else:
                    least = min(least, _NEAR_M)  # it is looked at again now and then
                    continue
            nearest: cython.double = 1e9
            where: cython.double = 0.0
            which: cython.Py_ssize_t = 0
            for c in range(self._capsule_count):
                if self._can_feel(c, s):
                    gap, part = self.gap(c, s, min(nearest, _NEAR_M))
                    if gap < 0.0 and self._is_part(s):
                        part = self.middle(c, s, part)
                    if gap < nearest:
                        nearest, where, which = gap, part, c
                if c + 1 == self._capsule_count or self._link[c + 1] != self._link[c]:
                    link = self._link[c]
                    if nearest < 0.0 or self._pushing[link, s] > 0.0:
                        contact = self._press(
                            which, s, where, -nearest, speeds, tick_s, torques, pushing, worn
                        )
                        if nearest < 0.0:
                            felt.append(contact)
                            if link < self._own_count:
                                on_links = True
                            else:
                                on_worn = True
                        nearest = 0.0
                    else:
                        self._touches[link, s] = 0
                    least = min(least, nearest)
                    nearest = 1e9
            for k in range(4):
                self._shifted[s, k] = 0.0
        self._free = least
        self.torques = tuple(torques) if on_links else None
        self.worn = tuple(worn) if on_worn else None
        self.contacts = tuple(felt)
        self.yielding_to = tuple(pushing) if any(pushing) else None
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _is_part(self, s: cython.Py_ssize_t) -> cython.bint:
        """Whether that is no surface, but a part that lies."""
        return s >= self._shape_count - self._part_count

    @cython.cfunc
    @cython.exceptval(check=False)
    def _can_feel(self, c: cython.Py_ssize_t, s: cython.Py_ssize_t) -> cython.bint:
        """Whether a capsule feels a surface: the base feels none."""
        feels: cython.int = self._feels[c]
        if self._is_part(s):
            return self._moved_by[c] > 0 and feels >= _PARTS
        return self._moved_by[c] > 0 and feels % _PARTS == 1

    @cython.cfunc
    def _is_out(self, s: cython.Py_ssize_t, base_m: cython.double) -> cython.bint:
        """Whether no link is in a surface, and the base not deeper than so."""
        for c in range(self._capsule_count):
            if self._moved_by[c] > 0 and not self._can_feel(c, s):
                continue
            if self.gap(c, s, _NEAR_M)[0] < (-base_m if self._moved_by[c] == 0 else 0.0):
                return False
        return True

    @cython.cfunc
    def _press(
        self,
        c: cython.Py_ssize_t,
        s: cython.Py_ssize_t,
        part: cython.double,
        depth: cython.double,
        speeds: Any,
        tick_s: cython.double,
        torques: Any,
        pushing: Any,
        worn: Any,
    ) -> object:
        """Add what a surface does to a capsule that is so deep (m) in it, at a part of its line.

        Less than 0 is for one that is out of it since a robot that yields has been pushed by it.
        """
        e = self._ends
        x = e[c, 0] + part * (e[c, 3] - e[c, 0])
        y = e[c, 1] + part * (e[c, 4] - e[c, 1])
        z = e[c, 2] + part * (e[c, 5] - e[c, 2])
        self.distance(s, x, y, z)
        nx, ny, nz = self._nx, self._ny, self._nz
        radius = self._radius[c]
        x, y, z = x - radius * nx, y - radius * ny, z - radius * nz
        levers = []
        speed: cython.double = 0.0
        square: cython.double = 0.0
        lever: cython.double
        moves: cython.bint = any(speeds)
        a, p = self._axes, self._points
        for k in range(self._moved_by[c]):
            dx, dy, dz = x - p[k, 0], y - p[k, 1], z - p[k, 2]
            lever = (
                nx * (a[k, 1] * dz - a[k, 2] * dy)
                + ny * (a[k, 2] * dx - a[k, 0] * dz)
                + nz * (a[k, 0] * dy - a[k, 1] * dx)
            )
            levers.append(lever)
            square += lever * lever
            speed += lever * cython.cast(cython.double, speeds[k])
        stiffness: cython.double = self._share[c] * self._law[s, 0]
        damped: cython.double = 1.0 - self._law[s, 1] * speed
        force: cython.double = stiffness * depth * damped if depth > 0.0 and damped > 0.0 else 0.0
        # Of all contacts together no mode is stiffer than the sum of them.
        per_kg: cython.double = max(1, len(self.contacts)) * square / _LEAST_INERTIA
        stiff: cython.double = stiffness * tick_s * tick_s * per_kg
        link = self._link[c]
        push: cython.double = stiffness * (depth - tick_s * speed) + stiff * self._pushing[link, s]
        push = max(push, 0.0) / (1.0 + stiff)
        if moves:
            self._pushing[link, s] += _FOLLOWS * (push - self._pushing[link, s])
            if depth <= 0.0 and push == 0.0 and self._pushing[link, s] < _LEAST_PUSH_N:
                self._pushing[link, s] = 0.0
        else:
            self._pushing[link, s] = push = force
        fx, fy, fz = force * nx, force * ny, force * nz
        # A robot that yields is pushed by g.
        gx, gy, gz = push * nx, push * ny, push * nz
        rubs: cython.bint = self._law[s, 2] > 0.0 and force > 0.0
        if rubs:
            self._rub(c, s, x, y, z, speeds, tick_s, force)
            r = self._rubbed
            along: cython.double = min(stiffness, self._share[c] * _STIFFEST)
            rx: cython.double = -along * r[link, s, 0]
            ry: cython.double = -along * r[link, s, 1]
            rz: cython.double = -along * r[link, s, 2]
            fx, fy, fz = fx + rx, fy + ry, fz + rz
            if moves:
                rx, ry, rz = self._drag(c, s, x, y, z, speeds, tick_s, push)
            else:
                self._dragging[link, s, 0] = rx
                self._dragging[link, s, 1] = ry
                self._dragging[link, s, 2] = rz
            gx, gy, gz = gx + rx, gy + ry, gz + rz
        else:
            self._touches[link, s] = 0
        for k in range(self._moved_by[c]):
            if rubs:
                dx, dy, dz = x - p[k, 0], y - p[k, 1], z - p[k, 2]
                lx = a[k, 1] * dz - a[k, 2] * dy
                ly = a[k, 2] * dx - a[k, 0] * dz
                lz = a[k, 0] * dy - a[k, 1] * dx
                pushing[k] += gx * lx + gy * ly + gz * lz
                lever = fx * lx + fy * ly + fz * lz
            else:
                lever = levers[k]
                pushing[k] += lever * push
                lever = lever * force
            if link < self._own_count:
                torques[k] += lever
        if link >= self._own_count:
            whole = (fx, fy, fz, y * fz - z * fy, z * fx - x * fz, x * fy - y * fx)
            for i in range(6):
                worn[i] += whole[i]
        return LinkContact(self._capsules[c].link, self._names[s], (x, y, z), (fx, fy, fz))

    @cython.cfunc
    def _rub(
        self,
        c: cython.Py_ssize_t,
        s: cython.Py_ssize_t,
        x: cython.double,
        y: cython.double,
        z: cython.double,
        speeds: Any,
        tick_s: cython.double,
        normal_n: cython.double,
    ) -> object:
        """Wind the spring of friction of a capsule that touches a surface at that place; which way is out is
        in n."""
        r = self._rubbed
        link = self._link[c]
        if not self._touches[link, s]:
            self._touches[link, s] = 1
            r[link, s, 0] = r[link, s, 1] = r[link, s, 2] = 0.0
            d = self._dragging
            d[link, s, 0] = d[link, s, 1] = d[link, s, 2] = 0.0
            return None
        wx, wy, wz = self._gone(c, s, x, y, z, speeds, tick_s)
        nx, ny, nz = self._nx, self._ny, self._nz
        ex, ey, ez = r[link, s, 0] + wx, r[link, s, 1] + wy, r[link, s, 2] + wz
        out = ex * nx + ey * ny + ez * nz
        ex, ey, ez = ex - out * nx, ey - out * ny, ez - out * nz
        length = sqrt(ex * ex + ey * ey + ez * ez)
        holding: cython.double = self._share[c] * min(self._law[s, 0], _STIFFEST)
        longest: cython.double = self._law[s, 2] * normal_n / holding
        if length > longest:
            share = longest / length
            ex, ey, ez = share * ex, share * ey, share * ez
        r[link, s, 0], r[link, s, 1], r[link, s, 2] = ex, ey, ez
        return None

    @cython.cfunc
    def _drag(
        self,
        c: cython.Py_ssize_t,
        s: cython.Py_ssize_t,
        x: cython.double,
        y: cython.double,
        z: cython.double,
        speeds: Any,
        tick_s: cython.double,
        push_n: cython.double,
    ) -> tuple[cython.double, cython.double, cython.double]:
        """Friction (N) as a robot that yields gives way to it, found as its normal force is."""
        a, p, r, d = self._axes, self._points, self._rubbed, self._dragging
        link = self._link[c]
        stiffness: cython.double = self._share[c] * min(self._law[s, 0], _STIFFEST)
        square: cython.double = 0.0
        for k in range(self._moved_by[c]):
            dx, dy, dz = x - p[k, 0], y - p[k, 1], z - p[k, 2]
            lx = a[k, 1] * dz - a[k, 2] * dy
            ly = a[k, 2] * dx - a[k, 0] * dz
            lz = a[k, 0] * dy - a[k, 1] * dx
            square += lx * lx + ly * ly + lz * lz
        stiff: cython.double = (
            stiffness * tick_s * tick_s * max(1, len(self.contacts)) * square / _LEAST_INERTIA
        )
        wx, wy, wz = self._gone(c, s, x, y, z, speeds, tick_s)
        nx, ny, nz = self._nx, self._ny, self._nz
        out = wx * nx + wy * ny + wz * nz
        share: cython.double = 1.0 / (1.0 + stiff)
        wx = share * (stiff * d[link, s, 0] - stiffness * (r[link, s, 0] + wx - out * nx))
        wy = share * (stiff * d[link, s, 1] - stiffness * (r[link, s, 1] + wy - out * ny))
        wz = share * (stiff * d[link, s, 2] - stiffness * (r[link, s, 2] + wz - out * nz))
        length = sqrt(wx * wx + wy * wy + wz * wz)
        longest: cython.double = self._law[s, 2] * push_n
        if length > longest:
            share = longest / length
            wx, wy, wz = share * wx, share * wy, share * wz
        d[link, s, 0] += _FOLLOWS * (wx - d[link, s, 0])
        d[link, s, 1] += _FOLLOWS * (wy - d[link, s, 1])
        d[link, s, 2] += _FOLLOWS * (wz - d[link, s, 2])
        return wx, wy, wz

    @cython.cfunc
    def _gone(
        self,
        c: cython.Py_ssize_t,
        s: cython.Py_ssize_t,
        x: cython.double,
        y: cython.double,
        z: cython.double,
        speeds: Any,
        tick_s: cython.double,
    ) -> tuple[cython.double, cython.double, cython.double]:
        """How far (m) the material of a capsule at that place has gone since the last look, as seen from a
        surface there."""
        wx: cython.double = 0.0
        wy: cython.double = 0.0
        wz: cython.double = 0.0
        turn: cython.double
        a, p = self._axes, self._points
        for k in range(self._moved_by[c]):
            turn = tick_s * cython.cast(cython.double, speeds[k])
            dx, dy, dz = x - p[k, 0], y - p[k, 1], z - p[k, 2]
            wx += turn * (a[k, 1] * dz - a[k, 2] * dy)
            wy += turn * (a[k, 2] * dx - a[k, 0] * dz)
            wz += turn * (a[k, 0] * dy - a[k, 1] * dx)
        m, t = self._shifted, self._shapes
        wx -= m[s, 0] - m[s, 3] * (y - t[s, 10])
        wy -= m[s, 1] + m[s, 3] * (x - t[s, 9])
        wz -= m[s, 2]
        return wx, wy, wz

    def balls(self, name: str, joints: Sequence[float], tick_s: float, near_m: float) -> list[Ball]:
        """What of the arm, at joint positions (rad), is no farther than this from a part that lies."""
        s: cython.Py_ssize_t = self._names.index(name)
        found: list[Ball] = []
        self.go_to(joints)
        if self._muted[s]:
            return found
        known: cython.bint = self._before[0] == self._before[0]
        speeds = self._speeds(joints, tick_s if known else 0.0)
        nearest: cython.double = 1e9
        where: cython.double = 0.0
        which: cython.Py_ssize_t = 0
        e, r = self._ends, self._rubbed
        for c in range(self._capsule_count):
            if self._can_feel(c, s):
                gap, part = self.gap(c, s, min(nearest, near_m))
                if gap < near_m:
                    part = self.middle(c, s, part)
                if gap < nearest:
                    nearest, where, which = gap, part, c
            if c + 1 == self._capsule_count or self._link[c + 1] != self._link[c]:
                if nearest < near_m:
                    x = e[which, 0] + where * (e[which, 3] - e[which, 0])
                    y = e[which, 1] + where * (e[which, 4] - e[which, 1])
                    z = e[which, 2] + where * (e[which, 5] - e[which, 2])
                    self.distance(s, x, y, z)
                    nx, ny, nz = self._nx, self._ny, self._nz
                    radius = self._radius[which]
                    rubbed = (0.0, 0.0, 0.0)
                    link = self._link[which]
                    if self._touches[link, s]:
                        wx, wy, wz = self._gone(
                            which, s, x - radius * nx, y - radius * ny, z - radius * nz, speeds, tick_s
                        )
                        wx, wy, wz = r[link, s, 0] + wx, r[link, s, 1] + wy, r[link, s, 2] + wz
                        out = wx * nx + wy * ny + wz * nz
                        rubbed = (wx - out * nx, wy - out * ny, wz - out * nz)
                    found.append(Ball((x, y, z), radius, rubbed, self._share[which]))
                nearest = 1e9
        return found

    def goes(self, joints: Sequence[float]) -> float:
        """No point of the arm, now at joint positions (rad), nor of what it wears, has gone farther (m) since
        this was asked last; 0 where it never was."""
        self.go_to(joints)
        e, b = self._ends, self._ends_before
        most: cython.double = 0.0
        for c in range(self._capsule_count):
            for j in range(0, 6, 3):
                dx, dy, dz = e[c, j] - b[c, j], e[c, j + 1] - b[c, j + 1], e[c, j + 2] - b[c, j + 2]
                most = max(most, dx * dx + dy * dy + dz * dz)
                for i in range(3):
                    b[c, j + i] = e[c, j + i]
        return float(sqrt(most))

    def gap_to(self, name: str) -> float:
        """How far (m) the arm, where `goes` was told that it is, is at least from a part that lies, less than
        0 in it."""
        s: cython.Py_ssize_t = self._names.index(name)
        least: cython.double = 1e9
        if self._muted[s]:
            return float(least)
        for c in range(self._capsule_count):
            if self._can_feel(c, s):
                gap, _part = self.gap(c, s, min(least, _NEAR_M))
                least = min(least, gap)
        return float(least)

    def away(self, middle: Vector, joints: Sequence[float]) -> float:
        """How far (m) the nearest capsule of the arm, at joint positions (rad), is from a place in the base;
        the base of the arm does not count."""
        self.go_to(joints)
        least: cython.double = 1e9
        px: cython.double
        py: cython.double
        pz: cython.double
        px, py, pz = middle
        e = self._ends
        for c in range(self._capsule_count):
            if self._moved_by[c] == 0 or self._feels[c] < _PARTS:
                continue
            ax, ay, az = e[c, 0] - px, e[c, 1] - py, e[c, 2] - pz
            dx, dy, dz = e[c, 3] - e[c, 0], e[c, 4] - e[c, 1], e[c, 5] - e[c, 2]
            square = dx * dx + dy * dy + dz * dz
            part: cython.double = 0.0
            if square > 0.0:
                part = min(max(-(ax * dx + ay * dy + az * dz) / square, 0.0), 1.0)
            ax, ay, az = ax + part * dx, ay + part * dy, az + part * dz
            least = min(least, sqrt(ax * ax + ay * ay + az * az) - self._radius[c])
        return float(least)
