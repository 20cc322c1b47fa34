"""The links of an arm, as capsules, that touch surfaces and each other.

**What a link feels.** A surface pushes the point of a link that is deepest in it with its stiffness times the
depth, damped as at the TCP, straight out to its nearest point; that makes torques on the joints that move the
link. There is no friction, and it is not remembered by which way a link has come in.

**What the arm stands in** does not count: a surface in which a link is where the robot starts, or is placed,
or where the surface is put, pushes no link until all of them have been out of it; neither does one in which
the base stands deeper than `STANDS_M`. So a table may be a plane without end. The base feels nothing.

**A robot that yields** gives way to the same forces, but for what keeps it calm at any tick: the force is the
one that the surface will have at the end of the next tick, if the link has the least mass that it can have
there, and if what else pushes it goes on as it has on the average of the last ticks. At rest it is the same.

**Cost.** After a look at all links and surfaces nothing is looked at again until the joints have turned so
far that the nearest of them could touch.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt
from numpy.typing import NDArray

from iiwa_sim.contact.shapes import Box, Cylinder, Plane, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import IDENTITY, Transform, Vector, apply, compose, inverse
from iiwa_sim.robot.capsules import Capsule

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.trigonometry_kernel import cosine, sine
else:
    from iiwa_sim.robot.trigonometry_kernel import cosine, sine

_PLANE = cython.declare(cython.int, 0)
_BOX = cython.declare(cython.int, 1)
_SPHERE = cython.declare(cython.int, 2)
_CYLINDER = cython.declare(cython.int, 3)
_KINDS = {Plane: 0, Box: 1, Sphere: 2, Cylinder: 3}
_GOLDEN = cython.declare(cython.double, 0.6180339887498949)
_CUTS = cython.declare(cython.Py_ssize_t, 30)  # of a line by the golden section: to 5e-7 of its length
# Of a pair that is farther apart (m) only a bound of the distance is found.
_NEAR_M = cython.declare(cython.double, 0.02)
# No arm that yields has a smaller moment of inertia about a joint (kg m^2), but near singular poses: as
# `motion/compliance_kernel.py` has it; a held one has more.
_LEAST_INERTIA = cython.declare(cython.double, 0.2)
# Part by which the average of a push follows it in a tick.
_FOLLOWS = cython.declare(cython.double, 0.1)
# A smaller average (N) of a link that touches nothing is none.
_LEAST_PUSH_N = cython.declare(cython.double, 1e-3)
STANDS_M = 0.02
"""A floor may reach so far into the base."""
_STANDS_M = cython.declare(cython.double, STANDS_M)
LEAST_LINKS_BETWEEN = 3
"""Of two links that are looked at for self-collision one is moved by so many joints more, at least: others
overlap, or cannot meet."""


class LinkContact(NamedTuple):
    """A link that touches a surface."""

    link: str
    surface: str
    point: Vector
    """Of the link, where the surface acts (m, in the base)."""
    force: Vector
    """N, in the base, acting on the robot."""


@cython.cclass
class Links:
    """The capsules of one arm, and what surfaces do to them."""

    torques: Any = cython.declare(object, visibility="readonly")
    """Torque (Nm) on each joint; None where no link touches anything."""
    yielding_to: Any = cython.declare(object, visibility="readonly")
    """Torque (Nm) on each joint that a yielding robot gives way to; None where no link touches anything."""
    contacts: Any = cython.declare(object, visibility="readonly")
    """Tuple of `LinkContact`."""
    _capsules: Any
    _count: cython.Py_ssize_t  # of joints
    _capsule_count: cython.Py_ssize_t
    _link_count: cython.Py_ssize_t
    _fixed: cython.double[:, ::1]  # in the form of `Tcp`
    _link: cython.Py_ssize_t[::1]  # of each capsule: the number of its link
    _moved_by: cython.Py_ssize_t[::1]
    _local: cython.double[:, ::1]  # of each capsule: both ends, in the frame of the joint that moves it last
    _radius: cython.double[::1]
    _levers: cython.double[::1]  # no point of a link is farther from the axis of a joint (m)
    _axes: cython.double[:, ::1]
    _points: cython.double[:, ::1]
    _frames: cython.double[:, ::1]  # of joints, as rows of `_fixed`
    _ends: cython.double[:, ::1]  # of each capsule: both ends in the base
    _names: Any
    _surface_count: cython.Py_ssize_t
    _surfaces: cython.double[:, ::1]  # rotation, place, three sizes, stiffness, damping
    _kind: cython.int[::1]
    _muted: cython.char[::1]  # surfaces that push no link
    _pushing: cython.double[:, ::1]  # force (N) on a link of a robot that yields, on the average
    _free: cython.double  # way (m) that any point of the arm can go before a link could touch something
    _before: cython.double[::1]  # joint positions of the last tick (rad)
    _nx: cython.double
    _ny: cython.double
    _nz: cython.double
    _self_pairs: Any

    def __init__(self, fixed: NDArray[np.float64], capsules: Sequence[Capsule]) -> None:
        """`fixed` are the constant poses between joints, of a `Tcp` without a tool."""
        self._fixed = fixed
        self._count = count = len(fixed) - 1
        self._frames = np.zeros((count + 1, 12))
        self._axes, self._points = np.zeros((count, 3)), np.zeros((count, 3))
        self._before = np.full(count, np.nan)
        self._capsules: Any = tuple(capsules)
        self._capsule_count = len(self._capsules)
        names = list(dict.fromkeys(capsule.link for capsule in capsules))
        self._link_count = len(names)
        self._link = np.array([names.index(capsule.link) for capsule in capsules], dtype=np.intp)
        self._moved_by = np.array([capsule.joints for capsule in capsules], dtype=np.intp)
        self._radius = np.array([capsule.radius_m for capsule in capsules])
        frame = IDENTITY
        at_zero = [frame]
        for row in fixed.tolist()[:count]:
            frame = compose(frame, Transform(tuple(row[:9]), tuple(row[9:])))
            at_zero.append(frame)
        rows = []
        for capsule in capsules:
            frame = inverse(at_zero[capsule.joints])
            rows.append((*apply(frame, capsule.start), *apply(frame, capsule.end)))
        self._local = np.array(rows).reshape(len(rows), 6)
        self._ends = np.zeros((len(rows), 6))
        self._levers = np.array([_lever(joint, at_zero, capsules) for joint in range(1, count + 1)])
        self._self_pairs = None
        self._names: Any = ()
        self.torques: Any = None
        self.yielding_to: Any = None
        self.contacts: Any = ()
        self._surface_count = 0
        self._free = 0.0

    def surround(self, surfaces: Mapping[str, Surface], joints: Sequence[float]) -> None:
        """These are the surfaces from now on, and the robot is at joint positions (rad).

        A surface of a name that was there before may have been moved.
        """
        before = {name: number for number, name in enumerate(self._names)}
        muted: Any = self._muted if before else None
        pushing: Any = self._pushing if before else None
        rows, kinds = [], []
        for surface in surfaces.values():
            rotation, place = surface.pose
            sizes = (*surface.shape, 0.0, 0.0, 0.0)[:3]
            rows.append((*rotation, *place, *sizes, surface.stiffness, surface.damping))
            kinds.append(_KINDS[type(surface.shape)])
        self._names = tuple(surfaces)
        self._surface_count = len(rows)
        self._surfaces = np.array(rows).reshape(len(rows), 17)
        self._kind = np.array(kinds, dtype=np.intc)
        self._muted = np.zeros(max(len(rows), 1), dtype=np.int8)
        self._pushing = np.zeros((self._link_count, max(len(rows), 1)))
        self._go_to(joints)
        old: cython.Py_ssize_t
        for s in range(self._surface_count):
            old = before.get(self._names[s], -1)
            if old < 0:
                self._muted[s] = not self._is_out(s, _STANDS_M)
                continue
            self._muted[s] = muted[old]
            for c in range(self._link_count):
                self._pushing[c, s] = pushing[c, old]
        self._free = 0.0

    def forget(self) -> None:
        """Know of no surfaces: all of them are put anew by `surround`."""
        self._names, self._surface_count = (), 0
        self.torques, self.yielding_to, self.contacts = None, None, ()

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
    def _look(self, joints: Any, tick_s: cython.double) -> object:
        """Find what touches; the time is 0 where the robot has not moved here."""
        self._go_to(joints)
        moved = tick_s > 0.0
        speeds = [(joints[k] - self._before[k]) / tick_s if moved else 0.0 for k in range(self._count)]
        for k in range(self._count):
            self._before[k] = joints[k]
        least: cython.double = 1e9
        felt = []
        torques = [0.0] * self._count
        pushing = [0.0] * self._count
        for s in range(self._surface_count):
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
                if self._moved_by[c] > 0:
                    gap, part = self._gap(c, s, min(nearest, _NEAR_M))
                    if gap < nearest:
                        nearest, where, which = gap, part, c
                    if c + 1 == self._capsule_count or self._link[c + 1] != self._link[c]:
                        if nearest < 0.0 or self._pushing[self._link[c], s] > 0.0:
                            contact = self._press(which, s, where, -nearest, speeds, tick_s, torques, pushing)
                            if nearest < 0.0:
                                felt.append(contact)
                            nearest = 0.0
                        least = min(least, nearest)
                        nearest = 1e9
        self._free = least
        self.torques = tuple(torques) if felt else None
        self.contacts = tuple(felt)
        self.yielding_to = tuple(pushing) if any(pushing) else None
        return None

    @cython.cfunc
    def _is_out(self, s: cython.Py_ssize_t, base_m: cython.double) -> cython.bint:
        """Whether no link is in a surface, and the base not deeper than so."""
        for c in range(self._capsule_count):
            if self._gap(c, s, _NEAR_M)[0] < (-base_m if self._moved_by[c] == 0 else 0.0):
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
    ) -> object:
        """Add what a surface does to a capsule that is so deep (m) in it, at a part of its line.

        Less than 0 is for one that is out of it since a robot that yields has been pushed by it.
        """
        e = self._ends
        x = e[c, 0] + part * (e[c, 3] - e[c, 0])
        y = e[c, 1] + part * (e[c, 4] - e[c, 1])
        z = e[c, 2] + part * (e[c, 5] - e[c, 2])
        self._distance(s, x, y, z)
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
        stiffness: cython.double = self._surfaces[s, 15]
        damped: cython.double = 1.0 - self._surfaces[s, 16] * speed
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
        for k in range(self._moved_by[c]):
            lever = levers[k]
            torques[k] += lever * force
            pushing[k] += lever * push
        return LinkContact(
            self._capsules[c].link, self._names[s], (x, y, z), (force * nx, force * ny, force * nz)
        )

    def colliding(self, joints: Sequence[float]) -> tuple[str, str] | None:
        """Two links that are in each other at joint positions (rad), the deepest; None if none are.

        Which pairs can is found out at the first call, at which the robot should be where none are.
        """
        self._go_to(joints)
        if self._self_pairs is None:
            self._self_pairs = [
                (a, b)
                for a in range(self._capsule_count)
                for b in range(a + 1, self._capsule_count)
                if self._moved_by[b] - self._moved_by[a] >= LEAST_LINKS_BETWEEN and self._apart(a, b) > 0.0
            ]
        deepest, found = 0.0, None
        for a, b in self._self_pairs:
            apart = self._apart(a, b)
            if apart < deepest:
                deepest, found = apart, (self._capsules[a].link, self._capsules[b].link)
        return found

    @cython.cfunc
    def _go_to(self, joints: Any) -> object:
        """Find the ends of all capsules in the base."""
        f, m = self._fixed, self._frames
        for i in range(12):
            m[0, i] = 1.0 if i in (0, 4, 8) else 0.0
        for k in range(self._count):
            for i in range(3):
                m[k + 1, 9 + i] = m[k, 9 + i] + (
                    m[k, 3 * i] * f[k, 9] + m[k, 3 * i + 1] * f[k, 10] + m[k, 3 * i + 2] * f[k, 11]
                )
            s, c = sine(joints[k]), cosine(joints[k])
            for i in range(3):
                x = m[k, 3 * i] * f[k, 0] + m[k, 3 * i + 1] * f[k, 3] + m[k, 3 * i + 2] * f[k, 6]
                y = m[k, 3 * i] * f[k, 1] + m[k, 3 * i + 1] * f[k, 4] + m[k, 3 * i + 2] * f[k, 7]
                z = m[k, 3 * i] * f[k, 2] + m[k, 3 * i + 1] * f[k, 5] + m[k, 3 * i + 2] * f[k, 8]
                m[k + 1, 3 * i], m[k + 1, 3 * i + 1] = c * x + s * y, c * y - s * x
                m[k + 1, 3 * i + 2] = z
                self._axes[k, i], self._points[k, i] = z, m[k + 1, 9 + i]
        e, v = self._ends, self._local
        for n in range(self._capsule_count):
            k = self._moved_by[n]
            for j in range(0, 6, 3):
                for i in range(3):
                    e[n, j + i] = m[k, 9 + i] + (
                        m[k, 3 * i] * v[n, j] + m[k, 3 * i + 1] * v[n, j + 1] + m[k, 3 * i + 2] * v[n, j + 2]
                    )
        return None

    @cython.cfunc
    def _gap(
        self, c: cython.Py_ssize_t, s: cython.Py_ssize_t, enough: cython.double
    ) -> tuple[cython.double, cython.double]:
        """How far (m) a capsule is from a surface, less than 0 where it is in it; and at which part of its
        line it is nearest. Where that is more than `enough` any bound of it will do."""
        e = self._ends
        ax, ay, az = e[c, 0], e[c, 1], e[c, 2]
        dx, dy, dz = e[c, 3] - ax, e[c, 4] - ay, e[c, 5] - az
        radius = self._radius[c]
        half = 0.5 * sqrt(dx * dx + dy * dy + dz * dz)
        middle = self._distance(s, ax + 0.5 * dx, ay + 0.5 * dy, az + 0.5 * dz)
        if half == 0.0 or middle - half - radius > enough:
            return middle - half - radius, 0.5
        # The distance to a convex body is convex along a line.
        low: cython.double = 0.0
        high: cython.double = 1.0
        left: cython.double = 1.0 - _GOLDEN
        right: cython.double = _GOLDEN
        at_left = self._distance(s, ax + left * dx, ay + left * dy, az + left * dz)
        at_right = self._distance(s, ax + right * dx, ay + right * dy, az + right * dz)
        for _cut in range(_CUTS):
            if at_left <= at_right:
                high, right, at_right = right, left, at_left
                left = high - _GOLDEN * (high - low)
                at_left = self._distance(s, ax + left * dx, ay + left * dy, az + left * dz)
            else:
                low, left, at_left = left, right, at_right
                right = low + _GOLDEN * (high - low)
                at_right = self._distance(s, ax + right * dx, ay + right * dy, az + right * dz)
        part = 0.5 * (low + high)
        return self._distance(s, ax + part * dx, ay + part * dy, az + part * dz) - radius, part

    @cython.cfunc
    @cython.exceptval(check=False)
    def _distance(
        self, s: cython.Py_ssize_t, px: cython.double, py: cython.double, pz: cython.double
    ) -> cython.double:
        """Signed distance (m) of a point from a surface, as in `shapes`; the way out is then in n."""
        r = self._surfaces
        kind: cython.int = self._kind[s]
        px, py, pz = px - r[s, 9], py - r[s, 10], pz - r[s, 11]
        x: cython.double = r[s, 0] * px + r[s, 3] * py + r[s, 6] * pz
        y: cython.double = r[s, 1] * px + r[s, 4] * py + r[s, 7] * pz
        z: cython.double = r[s, 2] * px + r[s, 5] * py + r[s, 8] * pz
        nx: cython.double = 0.0
        ny: cython.double = 0.0
        nz: cython.double = 0.0
        if kind == _PLANE:
            distance, nz = z, 1.0
        elif kind == _SPHERE:
            c = sqrt(x * x + y * y + z * z)
            distance = c - r[s, 12]
            if c == 0.0:
                nz = 1.0
            else:
                nx, ny, nz = x / c, y / c, z / c
        elif kind == _BOX:
            a, b, c = fabs(x) - r[s, 12], fabs(y) - r[s, 13], fabs(z) - r[s, 14]
            if a <= 0.0 and b <= 0.0 and c <= 0.0:
                distance = max(a, b, c)
                if distance == a:
                    nx = 1.0 if x >= 0.0 else -1.0
                elif distance == b:
                    ny = 1.0 if y >= 0.0 else -1.0
                else:
                    nz = 1.0 if z >= 0.0 else -1.0
            else:
                a, b, c = max(a, 0.0), max(b, 0.0), max(c, 0.0)
                distance = sqrt(a * a + b * b + c * c)
                nx, ny, nz = a / distance, b / distance, c / distance
                nx, ny, nz = -nx if x < 0.0 else nx, -ny if y < 0.0 else ny, -nz if z < 0.0 else nz
        else:
            c = sqrt(x * x + y * y)
            a, b = c - r[s, 12], fabs(z) - r[s, 13]
            nx, ny = (x / c, y / c) if c > 0.0 else (1.0, 0.0)
            nz = -1.0 if z < 0.0 else 1.0
            if b <= 0.0 and b <= a:
                distance, nz = a, 0.0
            elif a <= 0.0:
                distance, nx, ny = b, 0.0, 0.0
            else:
                distance = sqrt(a * a + b * b)
                nx, ny, nz = nx * a / distance, ny * a / distance, nz * b / distance
        self._nx = r[s, 0] * nx + r[s, 1] * ny + r[s, 2] * nz
        self._ny = r[s, 3] * nx + r[s, 4] * ny + r[s, 5] * nz
        self._nz = r[s, 6] * nx + r[s, 7] * ny + r[s, 8] * nz
        return distance

    @cython.cfunc
    def _apart(self, a: cython.Py_ssize_t, b: cython.Py_ssize_t) -> cython.double:
        """How far (m) two capsules are apart, less than 0 where they are in each other."""
        e = self._ends
        ux, uy, uz = e[a, 3] - e[a, 0], e[a, 4] - e[a, 1], e[a, 5] - e[a, 2]
        vx, vy, vz = e[b, 3] - e[b, 0], e[b, 4] - e[b, 1], e[b, 5] - e[b, 2]
        wx, wy, wz = e[a, 0] - e[b, 0], e[a, 1] - e[b, 1], e[a, 2] - e[b, 2]
        uu = ux * ux + uy * uy + uz * uz
        vv = vx * vx + vy * vy + vz * vz
        uv = ux * vx + uy * vy + uz * vz
        uw = ux * wx + uy * wy + uz * wz
        vw = vx * wx + vy * wy + vz * wz
        square = uu * vv - uv * uv
        s: cython.double = 0.0
        t: cython.double = 0.0
        if square > 1e-12 * uu * vv:
            s = min(max((uv * vw - vv * uw) / square, 0.0), 1.0)
        if vv > 0.0:
            t = min(max((uv * s + vw) / vv, 0.0), 1.0)
        if uu > 0.0:
            s = min(max((uv * t - uw) / uu, 0.0), 1.0)
        dx, dy, dz = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
        return sqrt(dx * dx + dy * dy + dz * dz) - self._radius[a] - self._radius[b]


def _lever(joint: int, frames: Sequence[Transform], capsules: Sequence[Capsule]) -> float:
    """No point of a capsule that a joint moves is farther (m) from its axis, wherever the robot is."""
    longest = 0.0
    for capsule in capsules:
        if capsule.joints < joint:
            continue
        ways = [frames[k].translation for k in range(joint, capsule.joints + 1)]
        chain = sum(_distance_between(a, b) for a, b in pairwise(ways))
        last = frames[capsule.joints].translation
        ends = max(_distance_between(last, end) for end in (capsule.start, capsule.end))
        longest = max(longest, chain + ends + capsule.radius_m)
    return longest


def _distance_between(a: Vector, b: Vector) -> float:
    return float(np.linalg.norm(np.subtract(a, b)))
