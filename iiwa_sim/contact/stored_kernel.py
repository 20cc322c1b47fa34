"""What springs between parts store, and what that leaves of their motion: counted as it really is.

A corner of a part that turns goes on an arc, and round another body the way out changes: there what presses
is no plane. Where the arm, or what it holds, presses otherwise at the end of a tick than its planes say, the
ways are found again with planes as they are there, so that a part gets the force that the arm feels.

What would be too much at the end of a tick is taken from the parts' speed, and if that is not enough, from
their way, or by a longer one from what presses on them. So parts and springs have no more energy than before
the parts went. Of links, tools, jaws and what these hold they have no more than these give: by the force that
the arm feels when the tick has ended, along the way that it has gone in it. What these have pressed into
springs besides, in a kick that ends within the tick or where a corner turns round them, is taken from the
speed, too, or let go by the longer way.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

import cython
from cython.cimports.libc.math import fabs, sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.carried_kernel import Carried
else:
    from iiwa_sim.contact.carried_kernel import Carried

NEAR_M = 2e-4
"""What is no farther than this, and than it may come in the tick, is met."""
_NEAR = cython.declare(cython.double, NEAR_M)
# So often ways are found anew, and depths (m, and part of them) that differ by no more are the same.
_ROUNDS = cython.declare(cython.Py_ssize_t, 3)
_FLAT_M = cython.declare(cython.double, 1e-9)
_FLAT = cython.declare(cython.double, 1e-3)
# It is out by the same side as before where the cosine between the ways out is more.
_SAME_SIDE = cython.declare(cython.double, 0.5)
_HALVINGS = cython.declare(cython.Py_ssize_t, 12)
# By so much farther, and so often, parts go that cannot pay by their speed what is pressed into springs.
_STRETCH = cython.declare(cython.double, 1.5)
_STRETCHES = cython.declare(cython.Py_ssize_t, 5)
_SPHERE = cython.declare(cython.int, 2)
_CYLINDER = cython.declare(cython.int, 3)
# Of half an edge: points there have the moments of a face.
_THIRD = cython.declare(cython.double, 0.5773502691896258)
# A ball touches on a disc of radius a = sqrt(R d), which presses more in its middle (Hertz): where it turns
# on that, friction takes 3 pi / 16 mu N a (K. L. Johnson, Contact Mechanics, 1985, sections 4.2 and 7.4);
# along both axes, of points at that lever.
_SPIN = cython.declare(cython.double, 0.5890486225480862 * 0.7071067811865476)


@cython.cclass
class Stored(Carried):
    """Parts that may move, and what they have of energy."""

    @cython.cfunc
    @cython.exceptval(check=False)
    def _rest_on(
        self, n: cython.Py_ssize_t, mass: cython.double, more: cython.double, about: cython.double
    ) -> cython.void:
        """The four points at which a part rubs on what it lies on, with the moments of its face, and its
        inertia."""
        p, size, g = self._pose, self._size, self._points
        ax: cython.double = 0.0
        ay: cython.double = 0.0
        bx: cython.double = 0.0
        by: cython.double = 0.0
        turning: cython.double
        if self._kind[n] == _SPHERE:
            turning = 0.4 * mass * size[n, 0] * size[n, 0]
            ax = by = _SPIN * sqrt(size[n, 0] * self._below[n, 2] / self._below[n, 0])
        elif self._kind[n] == _CYLINDER and self._upright[n] >= 0:
            ax = by = 0.5 * size[n, 0]
            turning = 0.5 * mass * size[n, 0] * size[n, 0]
        elif self._kind[n] == _CYLINDER:
            ax, ay = _THIRD * size[n, 1] * p[n, 2], _THIRD * size[n, 1] * p[n, 5]
            turning = mass * (0.25 * size[n, 0] * size[n, 0] + size[n, 1] * size[n, 1] / 3.0)
        else:
            up: cython.Py_ssize_t = self._upright[n] if self._upright[n] >= 0 else 2
            i: cython.Py_ssize_t = (up + 1) % 3
            j: cython.Py_ssize_t = (up + 2) % 3
            ax, ay = _THIRD * size[n, i] * p[n, i], _THIRD * size[n, i] * p[n, 3 + i]
            bx, by = _THIRD * size[n, j] * p[n, j], _THIRD * size[n, j] * p[n, 3 + j]
            turning = mass * (size[n, i] * size[n, i] + size[n, j] * size[n, j]) / 3.0
        g[n, 0], g[n, 1], g[n, 2], g[n, 3] = ax + bx, ay + by, bx - ax, by - ay
        g[n, 4], g[n, 5], g[n, 6], g[n, 7] = -ax - bx, -ay - by, ax - bx, ay - by
        for k in range(3):
            self._mass[n, k] = mass + more
        self._mass[n, 3] = turning + about

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
    @cython.exceptval(check=False)
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
        for k in range(self._many):
            moving += self._energy(k, 0.0)
        for _half in range(_HALVINGS):
            self._put(share)
            left: cython.double = moving - self._gained(share == 1.0)
            if left >= 0.0:
                if share == 1.0 and left < self._unfelt:
                    share = self._farther(moving)
                    left = moving - self._gained(share == 1.0)
                fast: cython.double = 0.0
                for k in range(self._many):
                    fast += self._energy(k, share)
                left = max(0.0, left - self._unfelt)
                slower = 1.0 if fast <= left else sqrt(left / fast)
                break
            share *= 0.5
        else:
            share = 0.0
            self._put(0.0)
            self._gained(False)
        for m in range(self._met):
            self._keep(m)
        self._share, self._slower = share, slower
        return None

    @cython.cfunc
    @cython.exceptval(-1.0, check=True)
    def _farther(self, moving: cython.double) -> cython.double:
        """The share of the way, 1 or more, at which no more is stored than the arm has given and the parts,
        with that energy of motion (J), have had; or else the least more. All are there then."""
        share: cython.double = 1.0
        best: cython.double = 1.0
        least: cython.double = self._unfelt - (moving - self._gained(True))
        for _longer in range(_STRETCHES):
            share *= _STRETCH
            self._put(share)
            owed: cython.double = self._unfelt - (moving - self._gained(False))
            if owed < least:
                best, least = share, owed
            if owed <= 0.0:
                break
        self._put(best)
        return best

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
    @cython.exceptval(check=False)
    def _gained(self, winds: cython.bint) -> cython.double:
        """How much more is stored where all are now than before (J): by height, and in all springs; friction
        only takes. What is stored is noted, and what of that the arm does not feel."""
        total: cython.double = 0.0
        stored: cython.double = 0.0
        unfelt: cython.double = 0.0
        c = self._c
        one: cython.double
        two: cython.double
        limit: cython.double
        for k in range(self._many):
            n = self._group[k]
            one = max(0.0, self._below[n, 3])  # what lies on it is lifted, too, though the spring hides that
            two = max(0.0, self._below[n, 3] - self._t[k, 2])
            total += self._below[n, 2] * self._t[k, 2] + 0.5 * self._below[n, 0] * (two * two - one * one)
            one = two = 0.0
            for j in range(4):
                one += self._wound[n, 2 * j] ** 2 + self._wound[n, 2 * j + 1] ** 2
                x, y = self._winds(k, j, winds)
                two += x * x + y * y
            total += 0.125 * self._below[n, 0] * (two - one)
        for m in range(self._met):
            one, two = max(0.0, c[m, 13]), max(0.0, self._touch(m, True, False))
            total += 0.5 * c[m, 4] * (two * two - one * one)
            if c[m, 33] >= 0.0 and (self._i[m, 0] < 0 or self._i[m, 1] == self._held):
                went: cython.double = c[m, 14] * c[m, 34] + c[m, 15] * c[m, 35] + c[m, 16] * c[m, 36]
                unfelt += max(0.0, c[m, 4] * (0.5 * one * one - 0.5 * c[m, 33] * c[m, 33] + two * went))
            stored += 0.5 * c[m, 4] * two * two
            limit = c[m, 5] * c[m, 4] * two
            if limit > 0.0:
                x, y, z = self._rub(m)
                total += _held(c[m, 6], limit, sqrt(x * x + y * y + z * z))
                x, y, z = c[m, 10], c[m, 11], c[m, 12]
                total -= _held(c[m, 6], limit, sqrt(x * x + y * y + z * z))
        self._stored, self._unfelt = stored, unfelt
        return total

    @cython.cfunc
    @cython.exceptval(check=False)
    def _winds(
        self, k: cython.Py_ssize_t, j: cython.Py_ssize_t, winds: cython.bint
    ) -> tuple[cython.double, cython.double]:
        """How far friction's spring at one of the points below a part is wound (m) where that is now."""
        n = self._group[k]
        x: cython.double = self._wound[n, 2 * j]
        y: cython.double = self._wound[n, 2 * j + 1]
        moves: cython.bint = False
        for i in range(4):
            moves = moves or self._t[k, i] != 0.0
        if not winds or not moves:
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
        longest: cython.double = c[m, 5] * c[m, 4] * max(0.0, c[m, 28]) / c[m, 6]
        x, y, z = self._rub(m)
        length = sqrt(x * x + y * y + z * z)
        share: cython.double = 1.0 if length <= longest else longest / length
        c[m, 10], c[m, 11], c[m, 12] = share * x, share * y, share * z
        self._stored += 0.5 * c[m, 6] * (c[m, 10] ** 2 + c[m, 11] ** 2 + c[m, 12] ** 2)
        self._remember(m, _NEAR)
        return None


@cython.cfunc
@cython.exceptval(check=False)
def _held(holding: cython.double, limit: cython.double, length: cython.double) -> cython.double:
    """What friction's spring stores, and takes where it slips (J)."""
    if holding * length <= limit:
        return 0.5 * holding * length * length
    return limit * length - 0.5 * limit * limit / holding
