"""How far an arm has gone, and what it holds, as far as somebody waits for that.

**Cost.** The way is found only when it may be so far that somebody is to look: in most ticks it is enough
that the joints have turned by less.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import fabs

from iiwa_sim.contact.load_kernel import ExternalLoad

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.at_tcp_kernel import take
    from cython.cimports.iiwa_sim.contact.links_beside_kernel import LinksBeside
    from cython.cimports.iiwa_sim.handling.held_kernel import Held
else:
    from iiwa_sim.contact.at_tcp_kernel import take
    from iiwa_sim.contact.links_beside_kernel import LinksBeside
    from iiwa_sim.handling.held_kernel import Held

FAR_M = 1e300
"""Farther than anything; less than nothing with a minus."""
_FAR = cython.declare(cython.double, FAR_M)
# Parts that are due within so many ticks like this one are looked at now: to find the way in each costs more.
_FEW = cython.declare(cython.double, 2.0)


@cython.cclass
class ArmWay:
    """The way of one arm, and where on it somebody is to look; the attributes are declared in the .pxd."""

    def __init__(self, load: ExternalLoad, tick_s: float, stroke_m: float) -> None:
        """The arm is that which the load acts on; its jaws open so far."""
        self._load = load
        self._tick, self._stroke = tick_s, stroke_m
        self._q, self._levers = np.zeros((2, len(load.levers_m)))
        self._tcp, self._now = np.zeros((2, 12))
        self._is_known = False
        self._in_jaws: Any = None
        self._begun = 0
        self._by = np.zeros(3)
        self._opening = self._way = self._loose = self._soon = self._brought = self._in_x = self._in_z = 0.0
        self.look_at_m = 0.0
        self.next_m = -_FAR
        self._rows: Any = {}
        self._due: Any = np.zeros(0)
        self._watch([])

    def look_at_all(self) -> None:
        """Have all that is near looked at in the next tick, whether it is due or not."""
        self.look_at_m = self.next_m = -_FAR
        for row in range(len(self.watched)):
            self._due[row] = -_FAR

    @cython.cfunc
    def _watch(self, names: Any) -> object:
        """Set the parts near the arm: what was near before is looked at when it was to be, others now."""
        rows, was = self._rows, self._due
        row: cython.Py_ssize_t
        before: cython.Py_ssize_t
        self.watched = names
        self._rows = {name: number for number, name in enumerate(names)}
        self._due = np.full(len(names), -_FAR)
        for name, row in self._rows.items():
            before = rows.get(name, -1)
            if before >= 0:
                self._due[row] = was[before]
        return None

    @cython.cfunc
    @cython.exceptval(check=False)
    def _find_next(self) -> cython.void:
        """Find where on the way the first of those that are near is looked at."""
        least: cython.double = _FAR
        for row in range(self._due.shape[0]):
            least = min(least, self._due[row])
        self.next_m = least

    @cython.cfunc
    @cython.exceptval(-1, check=True)
    def _turns(self, joints: Any) -> cython.bint:
        """A tick has brought the arm to joint positions (rad): whether that has turned any, or may have."""
        way: cython.double = 0.0
        q: cython.double
        for k in range(self._q.shape[0]):
            q = joints[k]
            if q != self._q[k]:
                way += self._levers[k] * fabs(q - self._q[k])
                self._q[k] = q
        self._loose += way
        self._soon = _FEW * way
        return way > 0.0 or not self._is_known

    @cython.cfunc
    def _goes(
        self,
        held: Held | None,
        tcp: Any,
        joints: Any,
        opening: cython.double,
        looks: cython.bint,
    ) -> object:
        """Add to the way what arm and jaws have gone, or what they hold, whichever is more, where that may
        matter in this tick."""
        other: cython.bint = not self._is_known or held is not self._in_jaws
        slid: cython.bint = False
        if other:
            self._find_levers(held)
            self.look_at_all()
        elif held is not None:
            slid = held._in[9] != self._in_x or held._in[11] != self._in_z
        sure: cython.bint = self._way + self._loose < min(self.look_at_m, self.next_m)
        if sure and not (looks or other or slid or opening != self._opening):
            return None
        links: LinksBeside = self._load.links
        if links.begun != self._begun:
            self._begun = links.begun
            self.look_at_all()
        way: cython.double = links.gone(joints)
        self._brought = self._by[0] = self._by[1] = self._by[2] = 0.0
        take(tcp, self._now)
        if held is not None:
            if not other:
                self._brought = held.way(self._tcp, self._in_x, self._in_z, self._now)
                way = max(way, self._brought)
                t, r, q = self._tcp, self._now, held._in
                x, y, z = self._in_x, q[10], self._in_z
                for k in range(3):
                    self._by[k] = (
                        r[3 * k] * q[9] + r[3 * k + 1] * q[10] + r[3 * k + 2] * q[11] + r[9 + k]
                    ) - (t[3 * k] * x + t[3 * k + 1] * y + t[3 * k + 2] * z + t[9 + k])
            self._in_x, self._in_z = held._in[9], held._in[11]
        self._tcp, self._now = self._now, self._tcp
        self._way, self._loose = self._way + way, 0.0
        self._is_known, self._opening, self._in_jaws = True, opening, held
        return None

    @cython.cfunc
    def _find_levers(self, held: Held | None) -> object:
        """Find how far (m) the axis of a joint is at most from what it moves: jaws may be farther out than
        when the arm put them on."""
        links: LinksBeside = self._load.links
        reach: cython.double = 0.0 if held is None else held._reach
        lever: cython.double
        levers = self._load.levers_m
        for k in range(self._levers.shape[0]):
            lever = levers[k]
            self._levers[k] = max(links._levers[k] + self._stroke, lever + reach)
        return None
