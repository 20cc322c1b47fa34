"""What springs between parts store, and what that leaves of their motion: counted as it really is.

A corner of a part that turns goes on an arc, and round another body the way out changes: there what presses
is no plane. Where the arm, or what it holds, presses otherwise at the end of a tick than its planes say, the
ways are found again with planes as they are there, so that a part gets the force that the arm feels.

What would be too much at the end of a tick is taken from the parts' speed, and if that is not enough, from
their way. So parts and springs have no more energy than before the parts went. Of links, tools, jaws and what
these hold they have no more than these give: by the force that the arm feels when the tick has ended, along
the way that it has gone in it. What these have pressed into springs besides, in a kick that ends within the
tick or where a corner turns round them, is taken from the speed, too; for what that cannot pay the arm is as
deep as it is without pressing, until it is less deep.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

import cython
from cython.cimports.libc.math import fabs, sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.carried_kernel import Carried
    from cython.cimports.iiwa_sim.contact.contact_kernel import Contact
else:
    from iiwa_sim.contact.carried_kernel import Carried
    from iiwa_sim.contact.contact_kernel import Contact

NEAR_M = 2e-4
"""What is no farther than this, and than it may come in the tick, is met."""
_NEAR = cython.declare(cython.double, NEAR_M)
# So often ways are found anew, and depths (m, and part of them) that differ by no more are the same.
_ROUNDS = cython.declare(cython.Py_ssize_t, 3)
_FLAT_M = cython.declare(cython.double, 1e-9)
_FLAT = cython.declare(cython.double, 1e-3)
# It is out by the same side as before where the cosine between the ways out is more.
_SAME_SIDE = cython.declare(cython.double, 0.5)
_ROUNDING_J = cython.declare(cython.double, 1e-13)
_HALVINGS = cython.declare(cython.Py_ssize_t, 12)


@cython.cclass
class Stored(Carried):
    """Parts that may move, and what they have of energy."""

    @cython.cfunc
    def _bend(self) -> object:
        """Find the ways anew where a part presses on the arm, or on what that holds, more or less at their
        ends than its planes say: with planes as they are there. So it gets the force that the arm feels."""
        for again in range(_ROUNDS):
            self._put(1.0)
            bent: cython.bint = False
            for m in range(self._met):
                if self._i[m, 0] < 0 or self._i[m, 1] == self._held:
                    bent = self._take_plane(m, again + 1 < _ROUNDS) or bent
            if not bent:
                return None
            self._balance()
        return None

    @cython.cfunc
    @cython.exceptval(-1, check=True)
    def _take_plane(self, m: cython.Py_ssize_t, turns: cython.bint) -> cython.bint:
        """Take the plane of a place where all are now, unless it is there already; whether it was not.

        Where it `turns`, the plane may be of another side than that by which the place has come in.
        """
        c, p, e = self._c, self._pose, self._e
        k: cython.Py_ssize_t
        q: cython.Py_ssize_t
        x: cython.Py_ssize_t
        depth: cython.double = self._touch(m, True, False)
        plane: cython.double = self._depth(m)
        if max(depth, plane) <= 0.0 or fabs(depth - plane) <= _FLAT_M + _FLAT * fabs(depth):
            return False
        along: cython.double = c[m, 22] * c[m, 7] + c[m, 23] * c[m, 8] + c[m, 24] * c[m, 9]
        if along < _SAME_SIDE and not turns:
            return False  # past an edge it is not pressed, comes back, and is pressed past it again
        depth = self._touch(m, True, True)
        for q in range(self._i[m, 4], self._i[m, 5]):
            k = self._of[q, 0]
            n = self._group[k]
            side: cython.Py_ssize_t = 1 if self._moved[q, 0] > 0.0 else 0
            x = self._i[m, side]
            lx: cython.double = c[m, 17 + 2 * side] - p[n, 9] - e[k, 0] + p[x, 9]
            ly: cython.double = c[m, 18 + 2 * side] - p[n, 10] - e[k, 1] + p[x, 10]
            self._moved[q, 3] = lx * c[m, 15] - ly * c[m, 14]
            self._open[k] = 1
        c[m, 29] = 0.0
        c[m, 29] = depth - self._depth(m)
        return True

    @cython.cfunc
    def _go(self) -> object:
        """Have all go as far as what is really stored then allows."""
        self._bend()
        moving: cython.double = 0.0
        share: cython.double = 1.0
        slower: cython.double = 0.0
        left: cython.double = 0.0
        for k in range(self._many):
            moving += self._energy(k, 0.0)
        for half in range(_HALVINGS + 1):
            if half == _HALVINGS:
                share = 0.0
            self._put(share)
            left = moving - self._gained()
            if left >= 0.0 or share == 0.0:
                left -= self._unfelt
                if left < -_ROUNDING_J:
                    left = self._press_less(moving)
                if left >= -_ROUNDING_J:
                    left = max(0.0, left)
                    break
            share *= 0.5
        if share > 0.0:
            fast: cython.double = self._farther_out()
            for k in range(self._many):
                fast += self._energy(k, share)
            slower = 1.0 if fast <= left else sqrt(left / fast)
        for m in range(self._met):
            self._keep(m)
        self._slower = slower
        return None

    @cython.cfunc
    @cython.exceptval(-1e300, check=True)
    def _press_less(self, moving: cython.double) -> cython.double:
        """Have arm and held part press on parts only as deep as there is energy for, with that energy of
        motion (J) before; gives what is left of it. Where there is not enough for no depth they press as they
        did, and less than 0 is given."""
        c = self._c
        low: cython.double = 0.0
        high: cython.double = 1.0
        left: cython.double = 0.0
        for m in range(self._met):
            c[m, 53], c[m, 54] = c[m, 28], c[m, 32]
        for half in range(_HALVINGS + 1):
            share: cython.double = low if half == _HALVINGS else 0.5 * (low + high)
            for m in range(self._met):
                if c[m, 53] > 0.0 and (self._i[m, 0] < 0 or self._i[m, 1] == self._held):
                    c[m, 32] = c[m, 28] + c[m, 30] - share * c[m, 53]
            left = moving - self._gained() - self._unfelt
            if left >= 0.0:
                low = share
            else:
                high = share
        if left < -_ROUNDING_J:
            for m in range(self._met):
                c[m, 32] = c[m, 54]
            self._gained()
        return left

    @cython.cfunc
    @cython.exceptval(check=False)
    def _energy(self, k: cython.Py_ssize_t, share: cython.double) -> cython.double:
        """Energy of motion (J) of one part: before, or for a share of the way."""
        n = self._group[k]
        total: cython.double = 0.0
        fast: cython.double
        for i in range(4):
            fast = self._velocity[n, i] if share == 0.0 else share * self._d[k, i] / self._tick
            total += 0.5 * self._mass[n, i] * fast * fast
        return total

    @cython.cfunc
    @cython.exceptval(-1e300, check=True)
    def _gained(self) -> cython.double:
        """How much more is stored where all are now than before (J): by height, and in all springs; friction
        only takes. What is stored is noted, and what of that the arm does not feel."""
        total: cython.double = 0.0
        stored: cython.double = 0.0
        unfelt: cython.double = 0.0
        c = self._c
        one: cython.double
        two: cython.double
        for k in range(self._many):
            n = self._group[k]
            one = max(0.0, self._below[n, 3])  # what lies on it is lifted, too, though the spring hides that
            two = max(0.0, self._below[n, 3] - self._t[k, 2])
            total += self._below[n, 2] * self._t[k, 2] + 0.5 * self._below[n, 0] * (two * two - one * one)
            one = two = 0.0
            for j in range(4):
                one += self._wound[n, 2 * j] ** 2 + self._wound[n, 2 * j + 1] ** 2
                x, y = self._winds(k, j)
                two += x * x + y * y
            total += 0.125 * self._below[n, 0] * (two - one)
        for m in range(self._met):
            one, two = max(0.0, c[m, 13]), max(0.0, self._touch(m, True, False))
            total += 0.5 * c[m, 4] * (two * two - one * one)
            if c[m, 33] >= 0.0 and (self._i[m, 0] < 0 or self._i[m, 1] == self._held):
                went: cython.double = c[m, 45] * c[m, 34] + c[m, 46] * c[m, 35] + c[m, 47] * c[m, 36]
                unfelt += c[m, 4] * (0.5 * one * one - 0.5 * c[m, 33] * c[m, 33] + two * went)
            stored += 0.5 * c[m, 4] * two * two
            total += self._rubs_more(m)
        self._stored, self._unfelt = stored, max(0.0, unfelt)
        return total

    @cython.cfunc
    @cython.exceptval(check=False)
    def _rubs_more(self, m: cython.Py_ssize_t) -> cython.double:
        """How much more friction's spring at a place stores where all are now than before (J), less what the
        arm has done by that force."""
        c = self._c
        x: cython.double
        y: cython.double
        z: cython.double
        more: cython.double
        x, y, z = self._held_by_friction(m)
        more = x * x + y * y + z * z
        if self._i[m, 0] >= 0:
            return 0.5 * c[m, 6] * (more - c[m, 10] ** 2 - c[m, 11] ** 2 - c[m, 12] ** 2)
        work: cython.double = 0.0
        if c[m, 33] >= 0.0:  # it goes as its middle does, and turns
            nx, ny, nz, far = c[m, 45], c[m, 46], c[m, 47], c[m, 3]
            work = x * (c[m, 34] - far * (c[m, 56] * nz - c[m, 57] * ny))
            work += y * (c[m, 35] - far * (c[m, 57] * nx - c[m, 55] * nz))
            work += z * (c[m, 36] - far * (c[m, 55] * ny - c[m, 56] * nx))
        x, y, z = c[m, 48], c[m, 49], c[m, 50]
        if x != 0.0 or y != 0.0 or z != 0.0:  # else it has not touched before
            if c[m, 33] >= 0.0:
                x, y, z = x - c[m, 34], y - c[m, 35], z - c[m, 36]
            more -= x * x + y * y + z * z
            if self._k[m] != -2:  # of what is held: what of that is along the part
                out: cython.double = x * c[m, 45] + y * c[m, 46] + z * c[m, 47]
                more += out * out
        return c[m, 6] * (0.5 * more - work)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _held_by_friction(self, m: cython.Py_ssize_t) -> tuple[cython.double, cython.double, cython.double]:
        """How far friction's spring at a place is wound (m) where all are now; of the arm as that has it."""
        c = self._c
        longest: cython.double = c[m, 5] * c[m, 4] * max(0.0, c[m, 28]) / c[m, 6]
        x: cython.double
        y: cython.double
        z: cython.double
        if self._i[m, 0] < 0:
            n: cython.Py_ssize_t = self._i[m, 1]
            k: cython.Py_ssize_t = self._slot[n]
            x, y, z = c[m, 48], c[m, 49], c[m, 50]
            nx, ny, nz = c[m, 45], c[m, 46], c[m, 47]
            contact: Contact | None = self._contacts[m]
            e = self._e
            if contact is not None and c[m, 5] > 0.0 and k >= 0:
                x, y, z = contact.rubs(
                    e[k], self._turn[k], c[m, 0], c[m, 1], c[m, 2], c[m, 55], c[m, 56], c[m, 57]
                )
            elif k >= 0:
                turn: cython.double = self._turn[k, 1]
                x -= e[k, 0] - turn * (c[m, 52] - self._pose[n, 10] - e[k, 1])
                y -= e[k, 1] + turn * (c[m, 51] - self._pose[n, 9] - e[k, 0])
                z -= e[k, 2]
            out: cython.double = x * nx + y * ny + z * nz
            x, y, z = x - out * nx, y - out * ny, z - out * nz
        else:
            x, y, z = self._rub(m)
        length: cython.double = sqrt(x * x + y * y + z * z)
        share: cython.double = 1.0 if length <= longest else longest / length
        return share * x, share * y, share * z

    @cython.cfunc
    @cython.exceptval(check=False)
    def _winds(self, k: cython.Py_ssize_t, j: cython.Py_ssize_t) -> tuple[cython.double, cython.double]:
        """How far friction's spring at one of the points below a part is wound (m) where that is now."""
        n = self._group[k]
        x: cython.double = self._wound[n, 2 * j]
        y: cython.double = self._wound[n, 2 * j + 1]
        moves: cython.bint = False
        for i in range(4):
            moves = moves or self._t[k, i] != 0.0
        if not moves:
            return x, y
        x += self._t[k, 0] - self._t[k, 3] * self._points[n, 2 * j + 1]
        y += self._t[k, 1] + self._t[k, 3] * self._points[n, 2 * j]
        carried: cython.double = self._below[n, 0] * max(0.0, self._below[n, 1] - self._t[k, 2])
        most: cython.double = self._material[n, 1] * carried / self._below[n, 0]
        length = sqrt(x * x + y * y)
        if length > most:
            x, y = x * most / length, y * most / length
        return x, y

    @cython.cfunc
    def _keep(self, m: cython.Py_ssize_t) -> object:
        """Remember a place as it is where all are now."""
        if self._k[m] == -2:
            return None
        c = self._c
        c[m, 10], c[m, 11], c[m, 12] = self._held_by_friction(m)
        self._stored += 0.5 * c[m, 6] * (c[m, 10] ** 2 + c[m, 11] ** 2 + c[m, 12] ** 2)
        self._remember(m, _NEAR)
        return None
