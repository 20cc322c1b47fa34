"""What lies on a part that is pushed goes along with it.

**Cost.** In a tower that goes, each part is taken along by each part below it, one after the other: as many
ways as half the square of its height. These are added up in numbers, and each part is put where it then is
once in a tick, or when somebody asks for it.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from typing import Any

import cython
import numpy as np

from iiwa_sim.contact.load_kernel import ExternalLoad
from iiwa_sim.frames import Transform
from iiwa_sim.handling.falling import LIES
from iiwa_sim.handling.pressing_kernel import solid_of
from iiwa_sim.handling.pushed_kernel import Known, Way, ended, gone_by, offset, turned
from iiwa_sim.handling.workpieces import Workpieces

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.at_tcp_kernel import as_transform, take
    from cython.cimports.iiwa_sim.contact.links_beside_kernel import LinksBeside
    from cython.cimports.iiwa_sim.handling.arm_way_kernel import ArmWay
    from cython.cimports.iiwa_sim.handling.piles_kernel import Piles
    from cython.cimports.iiwa_sim.robot.trigonometry_kernel import cosine, sine
else:
    from iiwa_sim.contact.at_tcp_kernel import as_transform, take
    from iiwa_sim.contact.links_beside_kernel import LinksBeside
    from iiwa_sim.handling.arm_way_kernel import ArmWay
    from iiwa_sim.handling.piles_kernel import Piles
    from iiwa_sim.robot.trigonometry_kernel import cosine, sine

_NO_MORE = (-0.0, -0.0, -0.0, -0.0)
"""A way that changes no bit of what it is added to."""


@cython.cclass
class TakenAlong(ArmWay):
    """The parts that have gone their ways in a tick, and what goes with them; the attributes are declared in
    the .pxd."""

    def __init__(self, pieces: Workpieces, load: ExternalLoad, tick_s: float, stroke_m: float) -> None:
        """What goes is put into `pieces`, and told to `load`, which feels it; the jaws open so far."""
        ArmWay.__init__(self, load, tick_s, stroke_m)
        self._pieces = pieces
        self._parts = Known(pieces)
        self._poses: dict[str, Transform] = {}
        least = max(len(pieces.bodies), 1)
        self._along, self._is_felt = np.zeros(least, dtype=np.int8), np.zeros(least, dtype=np.int8)
        self._has_turned, self._row = np.zeros(least, dtype=np.int8), np.zeros(least, dtype=np.intp)
        self._there, self._was = np.zeros((least, 12)), np.zeros(12)
        self._going: list[int] = []

    @cython.cfunc
    def _goes_on(self, gone: Any) -> object:
        """A part has gone its way in this tick, and so has what carries it."""
        pieces, parts = self._pieces, self._parts
        name = parts.names[gone.part]
        self._arrive(gone.part)
        self._arrive(parts.numbers.get(pieces.bodies[name].on, -1))
        body, face, (x, y, z, spin) = pieces.bodies[name], pieces.face_below(name), gone.velocity
        if body.state != LIES or face is None:
            return None
        pieces.pushed.add(name)
        pose = gone_by(body.pose, gone.way) if any(gone.way) else body.pose
        there = body._replace(pose=pose, velocity=(x, y, z), spin=spin, wound=gone.wound)
        if not face.has(pose.translation[0], pose.translation[1]):  # what is beside may keep it
            self._all_arrive()
        after = ended(pieces, there, face, gone.pressed)
        if after == body:
            return None
        middle, way = body.pose.translation, gone.way
        if after.state == LIES:
            pieces.put_aside(after)
            self._tell(after, body)
            self._take_along(gone.part, middle, way)
            return None
        self._all_arrive()
        riders = pieces.riders(name)
        pieces.put_aside(after)
        for each in riders:
            off = offset(middle, each.pose.translation)
            x, y, _ = turned(off, way[3])
            went: Way = (way[0] + (x - off[0]), way[1] + (y - off[1]), way[2], way[3])
            pieces.put_aside(pieces.bodies[each.part.name]._replace(pose=gone_by(each.pose, went)))
        return None

    @cython.cfunc
    def _take_along(self, number: cython.Py_ssize_t, middle: Any, way: Any) -> object:
        """What lies on a part goes with that, which has gone a way and turned about its `middle` (m)."""
        piles: Piles = self._pieces.piles
        links: LinksBeside = self._load.links
        n: cython.Py_ssize_t
        s: cython.Py_ssize_t
        first_row: cython.Py_ssize_t = links._shape_count - links._part_count
        mx: cython.double = middle[0]
        my: cython.double = middle[1]
        dx: cython.double = way[0]
        dy: cython.double = way[1]
        dz: cython.double = way[2]
        turn: cython.double = way[3]
        co: cython.double = cosine(turn)
        si: cython.double = sine(turn)
        px: cython.double
        py: cython.double
        before: cython.double
        below: cython.double
        p, q = self._there, self._was
        for at in range(piles._first[number], piles._end[number]):
            n = piles._order[at]
            if not self._along[n]:
                self._begin(n)
            for i in range(12):
                q[i] = p[n, i]
            px, py = q[9] - mx, q[10] - my
            if turn != 0.0:
                self._has_turned[n] = 1
                for i in range(3):
                    before, below = q[i], q[3 + i]
                    p[n, i] = co * before + (-si) * below + 0.0 * q[6 + i]
                    p[n, 3 + i] = si * before + co * below + 0.0 * q[6 + i]
                    p[n, 6 + i] = 0.0 * before + 0.0 * below + 1.0 * q[6 + i]
                px, py = (co * px - si * py) - px, (si * px + co * py) - py
            else:
                px, py = px - px, py - py
            p[n, 9], p[n, 10], p[n, 11] = q[9] + (dx + px), q[10] + (dy + py), q[11] + dz
            if self._row[n] < 0:
                continue
            is_other: cython.bint = False
            for i in range(12):
                is_other = is_other or p[n, i] != q[i]
            if is_other:
                self._is_felt[n], s = 1, first_row + self._row[n]
                for i in range(3):
                    links._shifted[s, i] += p[n, 9 + i] - q[9 + i]
                links._shifted[s, 3] += 0.5 * (
                    (q[0] * p[n, 3] - q[3] * p[n, 0])
                    + (q[1] * p[n, 4] - q[4] * p[n, 1])
                    + (q[2] * p[n, 5] - q[5] * p[n, 2])
                )
        return None

    @cython.cfunc
    def _begin(self, number: cython.Py_ssize_t) -> object:
        """A part begins to go along with another."""
        name = self._parts.names[number]
        take(self._pieces.bodies[name].pose, self._there[number])
        self._along[number], self._is_felt[number], self._has_turned[number] = 1, 0, 0
        self._row[number] = self._rows.get(name, -1)
        self._going.append(number)
        return None

    @cython.cfunc
    def _arrive(self, number: cython.Py_ssize_t) -> object:
        """A part, if it has gone along with others, is put where it is now."""
        if number < 0 or not self._along[number]:
            return None
        self._along[number] = 0
        name = self._parts.names[number]
        body = self._pieces.bodies[name]
        pose = as_transform(self._there[number])
        if not self._has_turned[number]:
            pose = body.pose._replace(translation=pose.translation)
        now = body._replace(pose=pose)
        self._pieces.put_aside(now)
        if self._is_felt[number]:
            self._poses[name] = pose
            self._load.shift(name, solid_of(now), _NO_MORE)
        return None

    @cython.cfunc
    def _all_arrive(self) -> object:
        """All that has gone along with others is put where it is now."""
        for number in self._going:
            self._arrive(number)
        self._going = []
        return None

    @cython.cfunc
    def _tell(self, after: Any, before: Any) -> object:
        """The arm feels a part that is near it where that is now."""
        name = after.part.name
        if name in self._rows and after.state == LIES and after.pose != before.pose:
            self._poses[name] = after.pose
            dx, dy, dz = offset(before.pose.translation, after.pose.translation)
            r, q = after.pose.rotation, before.pose.rotation
            # By the sine, which is the angle in a tick, of the axes before and now.
            turn = 0.5 * (
                (q[0] * r[3] - q[3] * r[0]) + (q[1] * r[4] - q[4] * r[1]) + (q[2] * r[5] - q[5] * r[2])
            )
            self._load.shift(name, solid_of(after), (dx, dy, dz, turn))
        return None
