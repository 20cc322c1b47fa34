"""Contact of the TCP: a sphere around it that surfaces push and hold.

**Normal force**: k d (1 + b d'), never less than 0, with the stiffness k, the penetration depth d and the
damping b (Hunt and Crossley, 1975, with a linear spring). The power lost is k b d d'^2.

**Friction**: a spring of the surface's stiffness from the TCP to an anchor, first the place where the TCP
came down. Its force is at most mu times the normal force; beyond that the anchor is dragged along. It acts
where the sphere touches.

Lengths are m, forces N, in the base unless stated otherwise.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import cython
import numpy as np
from cython.cimports.iiwa_sim.robot.arm_kernel import Tcp
from cython.cimports.libc.math import fabs, sqrt

from iiwa_sim.contact.shapes import Plane, follow
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Transform, apply, inverse
from iiwa_sim.wrench import NO_WRENCH, Wrench

# The anchor is dragged beyond this: rounding would otherwise move it at rest.
_SLIP_M = cython.declare(cython.double, 1e-12)


@cython.cclass
class Contact:
    """One surface and its memory of the TCP; the attributes are declared in the .pxd."""

    def __init__(self, surface: Surface, radius_m: float) -> None:
        """Start without contact; `radius_m` is that of the sphere."""
        self._radius = radius_m
        self._r, self._o, self._free = np.zeros(9), np.zeros(3), np.zeros(4)
        self._anchor, self._now = np.zeros(5), np.zeros(3)
        self._is_plane = isinstance(surface.shape, Plane)
        self._stiffness, self._damping, self._friction = surface.stiffness, surface.damping, surface.friction
        self._side: Any = None
        self.place(surface)

    def place(self, surface: Surface) -> None:
        """Take the surface at its pose."""
        self.surface = surface
        for k in range(9):
            self._r[k] = surface.pose.rotation[k]
        for k in range(3):
            self._o[k] = surface.pose.translation[k]
        self._free[3] = 0.0

    def move(self, pose: Transform) -> None:
        """Move the surface, and the anchor with it, to a pose."""
        before, a = self.surface.pose, self._anchor
        self.place(self.surface._replace(pose=pose))
        a[0], a[1], a[2] = apply(pose, apply(inverse(before), (a[0], a[1], a[2])))

    def memory(self) -> Any:
        """Return all that influences later forces."""
        return self._side, np.array(self._anchor)

    def restore(self, memory: Any) -> None:
        """Continue from such a memory."""
        self._side, self._free[3] = memory[0], 0.0
        for k in range(5):
            self._anchor[k] = memory[1][k]

    @cython.cfunc
    @cython.exceptval(check=False)
    def is_free(self, x: cython.double, y: cython.double, z: cython.double) -> cython.bint:
        """Return whether a place is in the ball without contact."""
        f = self._free
        x, y, z = x - f[0], y - f[1], z - f[2]
        return x * x + y * y + z * z < f[3]

    @cython.cfunc
    @cython.exceptval(-1, check=True)
    def press(self, p: cython.double[::1], remember: cython.bint, acting: cython.double[::1]) -> cython.bint:
        """Add the wrench on a TCP, by place and velocity, to `acting`; return True if it is touched."""
        r, o, n = self._r, self._o, self._now
        x: cython.double = p[0] - o[0]
        y: cython.double = p[1] - o[1]
        z: cython.double = p[2] - o[2]
        distance: cython.double
        if self._is_plane:
            n[0], n[1], n[2] = r[2], r[5], r[8]
            distance = r[2] * x + r[5] * y + r[8] * z
        else:
            end = (
                r[0] * x + r[3] * y + r[6] * z,
                r[1] * x + r[4] * y + r[7] * z,
                r[2] * x + r[5] * y + r[8] * z,
            )
            shape: Any = self.surface.shape
            found, side = follow(shape, self._side, end, self._radius)
            distance, x, y, z = found
            n[0] = r[0] * x + r[1] * y + r[2] * z
            n[1] = r[3] * x + r[4] * y + r[5] * z
            n[2] = r[6] * x + r[7] * y + r[8] * z
            if remember:
                self._side = side
        depth: cython.double = self._radius - distance
        if remember:
            self._anchor[4] = depth > 0.0
            self._free[0], self._free[1], self._free[2] = p[0], p[1], p[2]
            self._free[3] = depth * depth if depth < 0.0 else 0.0
        if depth <= 0.0:
            if remember:
                self._anchor[3] = 0.0
            return False
        damped: cython.double = 1.0 - self._damping * (p[3] * n[0] + p[4] * n[1] + p[5] * n[2])
        normal: cython.double = self._stiffness * depth * damped if damped > 0.0 else 0.0
        for k in range(3):
            acting[k] += normal * n[k]
        if self._friction > 0.0 and self._anchor[3] != 0.0:
            self._rub(p, self._friction * normal, remember, acting)
        elif self._friction > 0.0 and remember:
            self._anchor[3] = 1.0
            for k in range(3):
                self._anchor[k] = p[k]
        return True

    @cython.cfunc
    @cython.exceptval(check=False)
    def _rub(
        self, p: cython.double[::1], limit: cython.double, remember: cython.bint, acting: cython.double[::1]
    ) -> cython.void:
        """Add the friction, at most `limit` (N)."""
        a, n, r = self._anchor, self._now, self._radius
        d = cython.declare(cython.double[3])  # along the surface from the TCP to the anchor
        for k in range(3):
            d[k] = a[k] - p[k]
        out: cython.double = d[0] * n[0] + d[1] * n[1] + d[2] * n[2]
        for k in range(3):
            d[k] -= out * n[k]
        length: cython.double = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        longest: cython.double = limit / self._stiffness
        slips: cython.bint = length > longest + _SLIP_M
        if remember and (slips or (not self._is_plane and fabs(out) > _SLIP_M)):
            share: cython.double = longest / length if slips else 1.0
            length *= share
            for k in range(3):
                d[k] *= share
                a[k] = p[k] + d[k]
        held: cython.double = self._stiffness if length <= longest else limit / length
        for k in range(3):
            d[k] *= held
            acting[k] += d[k]
        acting[3] += r * (n[2] * d[1] - n[1] * d[2])
        acting[4] += r * (n[0] * d[2] - n[2] * d[0])
        acting[5] += r * (n[1] * d[0] - n[0] * d[1])


@cython.cclass
class TcpState:
    """Pose of the TCP after a tick, and the contact there, as a compliant motion has found both."""

    def __init__(self) -> None:
        """Start with nothing known."""
        self.at, self.acting = np.zeros(12), np.zeros(6)
        self.is_known = False


@cython.cclass
class TcpContact:
    """The surfaces of a cell, and the sphere around the TCP that touches them. Their forces add up."""

    def __init__(self, surfaces: Iterable[Surface], radius_m: float) -> None:
        """Take surfaces, each with its own name; a radius of 0 makes the sphere a point."""
        self.radius_m = radius_m
        self._contacts: dict[str, Contact] = {}
        self.changes, self.empty = 0, True
        self.is_known = self.settled = False
        self._at, self._place = np.zeros(12), np.zeros(3)
        self._acting, self._asked = np.zeros((2, 6))
        self._wrench: Any = NO_WRENCH
        for surface in surfaces:
            self.put(surface)

    @property
    def surfaces(self) -> dict[str, Surface]:
        """The surfaces by name."""
        return {name: contact.surface for name, contact in self._contacts.items()}

    def put(self, surface: Surface) -> None:
        """Add a surface, or replace the one of its name, without any memory of the TCP."""
        self._contacts[surface.name] = Contact(surface, self.radius_m)
        if self.empty:  # without surfaces the TCP may have gone on unnoticed
            self.empty = self.is_known = False
        self.changes += 1

    def move(self, name: str, pose: Transform) -> None:
        """Move a surface; a TCP that touches it continues to, if it still can."""
        self._contacts[name].move(pose)
        self.changes += 1

    def remove(self, name: str) -> None:
        """Remove a surface."""
        del self._contacts[name]
        self.empty = not self._contacts
        self.changes += 1

    def touched(self, name: str) -> bool:
        """Return whether a surface was touched at the last place of the TCP."""
        return bool(self._contacts[name].memory()[1][4])

    def forget(self) -> None:
        """Forget all contact and the place of the TCP."""
        self.is_known = False
        for surface in self.surfaces.values():
            self.put(surface)

    def memory(self) -> Any:
        """Return all that influences later forces."""
        return np.array(self._place), {name: each.memory() for name, each in self._contacts.items()}

    def restore(self, memory: Any) -> None:
        """Continue from such a memory, among the same surfaces."""
        self.is_known = True
        for k in range(3):
            self._place[k] = memory[0][k]
        for name, kept in memory[1].items():
            self._contacts[name].restore(kept)

    @cython.ccall
    @cython.exceptval(-1, check=True)
    def acts_at(
        self,
        px: cython.double,
        py: cython.double,
        pz: cython.double,
        vx: cython.double,
        vy: cython.double,
        vz: cython.double,
        remember: cython.bint,
        acting: cython.double[::1],
    ) -> cython.bint:
        """Write force (N) and torque (Nm) on a TCP at p with velocity v; return whether they are not 0."""
        p = self._asked
        p[0], p[1], p[2], p[3], p[4], p[5] = px, py, pz, vx, vy, vz
        for k in range(6):
            acting[k] = 0.0
        touched: cython.bint = False
        contact: Contact
        for contact in self._contacts.values():
            if not contact.is_free(px, py, pz):
                touched = contact.press(p, remember, acting) or touched
        if remember:
            self._place[0], self._place[1], self._place[2] = px, py, pz
        return touched and (acting[0] != 0.0 or acting[1] != 0.0 or acting[2] != 0.0)

    def begin(self, tcp: Tcp, joints: Any) -> Wrench:
        """Return the wrench along the axes of a TCP that is put, at rest, at joint positions (rad)."""
        self.is_known = False
        return self.step(tcp, joints, 1.0)

    def step(self, tcp: Tcp, joints: Any, tick_s: cython.double, reached: TcpState | None = None) -> Wrench:
        """Return the wrench along the axes of the TCP after a tick to joint positions (rad).

        `reached` is used instead if a compliant motion has already found pose and contact of this tick.
        """
        r, p, a = self._at, self._place, self._acting
        v = cython.declare(cython.double[3])
        if reached is None:
            tcp.go_to(joints)
            for k in range(9):
                r[k] = tcp.turned[k]
            for k in range(3):
                r[9 + k] = tcp.place[k]
        else:
            r[:] = reached.at
        stays: cython.bint = self.is_known
        for k in range(3):
            v[k] = (r[9 + k] - p[k]) / tick_s if self.is_known else 0.0
            stays = stays and v[k] == 0.0
        if reached is not None and reached.is_known:
            a[:] = reached.acting
            p[0], p[1], p[2] = r[9], r[10], r[11]
        else:
            self.acts_at(r[9], r[10], r[11], v[0], v[1], v[2], True, a)
        before, self._wrench, self.is_known = self._wrench, NO_WRENCH, True
        if a[0] != 0.0 or a[1] != 0.0 or a[2] != 0.0:
            w = cython.declare(cython.double[6])
            for k in range(3):
                w[k] = r[k] * a[0] + r[3 + k] * a[1] + r[6 + k] * a[2]
                w[3 + k] = r[k] * a[3] + r[3 + k] * a[4] + r[6 + k] * a[5]
            self._wrench = (w[0], w[1], w[2], w[3], w[4], w[5])
        self.settled = stays and before == self._wrench
        wrench: Wrench = self._wrench
        return wrench


@cython.cclass
class Gaps:
    """Lower bounds of distances in a moving arm. They decide which to measure again, and when."""

    def __init__(self, velocity: Any, arm: Tcp) -> None:
        """Take the greatest velocities (rad/s) of joints, and any frame fixed to the flange."""
        self._velocity, self._arm = np.array(velocity), arm
        self._looked, self._turns, self._rates = np.zeros((3, len(velocity)))
        self.take(np.zeros((0, len(velocity))), np.zeros((0, 7)), np.zeros((0, 2), np.int64), np.zeros(0))

    def take(self, levers: Any, capsules: Any, pairs: Any, touching: Any) -> None:
        """Have distances, by the greatest displacement (m) of each per turn (rad) of each joint.

        The last ones are those of `pairs` (k, 2) of capsules, from line to line, less `touching` (k,). A
        capsule has the number of joints that move it, and the ends of its line (m) in the last of these.
        """
        self._levers, self._capsules, self._pairs, self._touching = levers, capsules, pairs, touching
        self._lines = np.array(capsules[:, 1:])
        self._free, self._known = np.zeros((2, len(levers)))
        self.forget()

    def forget(self) -> None:
        """Know of no distance."""
        self._known[:] = np.inf
        self._fastest, self.next = 0.0, 0

    @cython.ccall
    @cython.exceptval(-1, check=True)
    def is_free(self, joints: Any, tick: cython.long, tick_s: cython.double) -> cython.bint:
        """Return whether no distance can be 0 in the tick of this number, at joint positions (rad)."""
        if tick < self.next:
            return True
        left: cython.double = 1.0
        q: cython.double
        for k in range(self._rates.shape[0]):
            q = joints[k]
            left -= self._rates[k] * fabs(q - self._looked[k])
        if left <= 0.0 and self._fastest != 0.0:
            # Pairs of an arm alone are measured as fast as bounds are found anew.
            if self._free.shape[0] > self._touching.shape[0] and self._turn(joints) > 0.0:
                self.begin(tick, tick_s)
                return True
            self._fastest, self.next = 0.0, 0
        if self._fastest == 0.0:
            return False
        self.next = tick + max(1, int(left / (self._fastest * tick_s)))
        return True

    @cython.cfunc
    @cython.exceptval(-1e9)
    def _turn(self, joints: Any) -> cython.double:
        """Move the joints to positions (rad); return the least bound (m), less a tenth of its distance."""
        least: cython.double = 1e9
        for k in range(self._looked.shape[0]):
            q: cython.double = joints[k]
            self._turns[k], self._looked[k] = fabs(q - self._looked[k]), q
        for row in range(self._free.shape[0]):
            for k in range(self._looked.shape[0]):
                self._free[row] -= self._turns[k] * self._levers[row, k]
            least = min(least, self._free[row] - 0.1 * self._known[row])
        return least

    def go_to(self, joints: Any) -> list[int]:
        """Move the arm to joint positions (rad); return the numbers of the distances to measure.

        Pairs of capsules are measured, and returned only if they are in each other, or were before.
        """
        rows, own = self._free.shape[0], self._touching.shape[0]
        self._turn(joints)
        self._arm.go_to(joints)
        self._place()
        due = []
        for row in range(rows):
            if self._free[row] <= 0.5 * self._known[row]:
                apart: cython.bint = row >= rows - own and self._known[row] > 0.0
                if row >= rows - own:
                    self._free[row] = self._known[row] = self._distance(row - rows + own)
                if not apart or self._free[row] <= 0.0:
                    due.append(row)
        return due

    @cython.cfunc
    @cython.exceptval(check=False)
    def _place(self) -> cython.void:
        """Find the lines of the capsules that move."""
        e, x, z = self._capsules, self._arm.sides, self._arm.axes
        for row in range(e.shape[0]):
            n = cython.cast(cython.Py_ssize_t, e[row, 0]) - 1
            for i in range(6 if n >= 0 else 0):
                k, first = i % 3, 1 + i // 3 * 3
                y = z[n, (k + 1) % 3] * x[n, (k + 2) % 3] - z[n, (k + 2) % 3] * x[n, (k + 1) % 3]
                along = e[row, first] * x[n, k] + e[row, first + 1] * y + e[row, first + 2] * z[n, k]
                self._lines[row, i] = self._arm.points[n, k] + along

    @cython.cfunc
    @cython.exceptval(check=False)
    def _distance(self, pair: cython.Py_ssize_t) -> cython.double:
        """Measure the distance of a pair of capsules (m), by the nearest points of their lines."""
        one, other = self._lines[self._pairs[pair, 0]], self._lines[self._pairs[pair, 1]]
        a = b = c = e = f = square = 0.0
        for i in range(3):
            u, v, w = one[3 + i] - one[i], other[3 + i] - other[i], one[i] - other[i]
            a, b, c, e, f = a + u * u, b + u * v, c + u * w, e + v * v, f + v * w
        s: cython.double = 0.0
        if a * e - b * b > 1e-12 * a * e:
            s = min(max((b * f - c * e) / (a * e - b * b), 0.0), 1.0)
        t: cython.double = min(max((b * s + f) / e, 0.0), 1.0) if e > 0.0 else 0.0
        s = min(max((b * t - c) / a, 0.0), 1.0) if a > 0.0 else 0.0
        for i in range(3):
            w = one[i] + s * (one[3 + i] - one[i]) - other[i] - t * (other[3 + i] - other[i])
            square += w * w
        return sqrt(square) - self._touching[pair]

    def set(self, row: cython.Py_ssize_t, distance: cython.double) -> None:
        """Note a measured distance (m)."""
        self._free[row] = self._known[row] = distance

    def approach(self, moved_m: float) -> None:
        """Have all bodies come nearer by so much."""
        np.asarray(self._free)[:] -= moved_m
        self.begin(0, 1.0)
        self.next = 0

    def begin(self, tick: cython.long, tick_s: cython.double) -> None:
        """Begin to count from the present bounds, in the tick of this number."""
        self._fastest, self.next, self._rates[:] = 0.0, tick + 1, 0.0
        fastest: cython.double = 1e-9
        for row in range(self._free.shape[0]):
            if self._free[row] <= 0.0:
                return
            share: cython.double = 1.0 / self._free[row]
            for k in range(self._rates.shape[0]):
                self._rates[k] = max(self._rates[k], self._levers[row, k] * share)
        for k in range(self._rates.shape[0]):
            fastest += self._rates[k] * self._velocity[k]
        self._fastest = fastest
        self.next = tick + max(1, int(1.0 / (fastest * tick_s)))
