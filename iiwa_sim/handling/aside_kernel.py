"""Which parts that lie are pushed in a tick: by the arm, by what it holds, and by each other.

**Cost.** Parts are looked for near the arm when it has gone so far that another could be near; of those that
are, each is looked at closely when the arm has gone so far that it could touch it. So parts far away cost
nothing, however many there are.
"""

# mypy: allow-untyped-decorators, allow-subclassing-any

from __future__ import annotations

from math import dist
from typing import Any

import cython
from cython.cimports.libc.math import sqrt

from iiwa_sim.contact.crowd import PressingBall
from iiwa_sim.contact.load_kernel import ExternalLoad
from iiwa_sim.frames import Transform
from iiwa_sim.handling.arm_way_kernel import FAR_M
from iiwa_sim.handling.between_kernel import between
from iiwa_sim.handling.falling import LIES
from iiwa_sim.handling.pressing_kernel import SEEN_M, by_the_arm, by_what_is_held, solid_held, solid_of
from iiwa_sim.handling.pushed_kernel import fastest
from iiwa_sim.handling.workpieces import Workpieces
from iiwa_sim.motion.joints import Joints

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.links_beside_kernel import LinksBeside
    from cython.cimports.iiwa_sim.handling.held_kernel import Held
    from cython.cimports.iiwa_sim.handling.taken_along_kernel import TakenAlong
else:
    from iiwa_sim.contact.links_beside_kernel import LinksBeside
    from iiwa_sim.handling.held_kernel import Held
    from iiwa_sim.handling.taken_along_kernel import TakenAlong

# Parts farther from the arm (m) are not looked at until it has come nearer.
_NEAR = cython.declare(cython.double, 0.2)
# Those that have been nearer are looked at until they are so far from it (m): what changes is dear.
_GONE = cython.declare(cython.double, 0.4)
# Way of the arm (m) after which parts are looked for; nearer than so each of them is known.
_LOOK_AGAIN = cython.declare(cython.double, 0.05)
# What is to be looked for within this way (m) is looked for with what is to be now.
_SOON = cython.declare(cython.double, 0.03)
# Parts that are due within this way (m) are looked at with one that is.
_TOGETHER = cython.declare(cython.double, 5e-3)
# What is farther from a part (m), and not on its way in a tick, does not touch it.
_CLOSE = cython.declare(cython.double, 5e-4)
_FAR = cython.declare(cython.double, FAR_M)


@cython.cclass
class Aside(TakenAlong):
    """The parts that lie, as the arm and what it holds push them, tick by tick.

    The attributes are declared in the .pxd.
    """

    def __init__(self, pieces: Workpieces, load: ExternalLoad, tick_s: float, stroke_m: float) -> None:
        """What is pushed is put into `pieces`, and told to `load`, which feels it; the jaws open so far."""
        TakenAlong.__init__(self, pieces, load, tick_s, stroke_m)
        self._seen: Any = -1
        self._changes: Any = -1
        self._known: dict[str, tuple[bool, float]] = {}
        self._solid: Any = None
        self._calm = False
        self._brought_up: list[str] = []

    @property
    def settled(self) -> bool:
        """Whether ticks push nothing as long as arm, jaws and parts stay where they are: the last one has
        not, or nothing lies there."""
        calm = bool(self._calm) and self._changes == self._pieces.changes
        return calm or not (self._pieces.lying or self.watched)

    def forget(self) -> None:
        """Arm or parts have been put elsewhere."""
        self._is_known, self._seen, self._calm, self._brought_up = False, -1, False, []
        self._poses: Any = {}
        self._load.lay({})
        self._watch([])

    def follow(self) -> None:
        """Tell the arm where parts near it are that slid by themselves, or with what carries them."""
        bodies = self._pieces.bodies
        for name, pose in list(self._poses.items()):
            body = bodies[name]
            if body.pose is not pose:
                self._tell(body, body._replace(pose=pose))

    @cython.cfunc
    def step(self, tcp: Transform, joints: Joints, opening: cython.double) -> object:
        """A tick has brought the arm to `joints` (rad), with its TCP there and its jaws so far apart (m)."""
        pieces, changes = self._pieces, self._pieces.changes
        pieces.pushed.clear()
        stays: cython.bint = not self._turns(joints) and self._changes == changes and opening == self._opening
        if stays and self._calm:
            return None
        held: Held | None = pieces._held
        if held is not None:
            held.touching.besides = None
        if not pieces._lying and not pieces.lying:  # found anew where it is None
            if self.watched:
                self.forget()
            return None
        moving = pieces.moving if pieces._lively else ()
        looks: cython.bint = self._seen != pieces.lying_changes
        self._goes(held, tcp, joints, opening, looks or len(moving) > 0)
        if moving:
            self._way += self._tick * max([fastest(pieces.bodies[name]) for name in moving])
        looks = looks or self._way >= self.look_at_m
        if self._brought_up:
            for name in self._brought_up:
                if name in self._rows:
                    self._due[cython.cast(cython.Py_ssize_t, self._rows[name])] = self.next_m = -_FAR
            self._brought_up = []
        if not (looks or moving or self._way + self._soon >= self.next_m):
            self._calm, self._changes = stays, changes
            return None
        self._solid = None
        if looks:
            self._look(held, tcp, joints)
        near = self._near_ones(held, tcp, joints, moving)
        if near:
            self._push(near, held, tcp, joints)
        self._find_next()
        self._calm = stays and changes == pieces.changes and not self._brought_up
        self._changes = pieces.changes
        return None

    @cython.cfunc
    def _near_ones(self, held: Held | None, tcp: Any, joints: Any, moving: Any) -> object:
        """The names of those that move or are carried by these, or that are due and on which arm or held part
        may press; in the order of the cell: what becomes of them must not depend on when they were looked
        at."""
        near = {*moving}
        if moving:
            piles = self._pieces.piles
            near |= piles.all_above([piles.numbers[name] for name in moving])
        row: cython.Py_ssize_t
        links: LinksBeside = self._load.surround(joints)
        least: cython.double = _FAR
        for row in range(self._due.shape[0]):
            least = min(least, self._due[row])
        # With the first that is due as many are looked at as will be soon.
        until: cython.double = self._way + max(_TOGETHER, self._soon)
        until = until if least <= self._way + self._soon else -_FAR
        for row in range(self._due.shape[0]):
            due: cython.bint = self._due[row] <= until and self.watched[row] not in near
            if due and self._gap(row, links, held, tcp) <= _CLOSE:
                near.add(self.watched[row])
        return sorted(near, key=self._parts.numbers.get) if near else ()

    @cython.cfunc
    @cython.exceptval(-1.0, check=True)
    def _gap(self, row: cython.Py_ssize_t, links: LinksBeside, held: Held | None, tcp: Any) -> cython.double:
        """How far (m) a part near the arm is at least from that, and what it holds: when it is looked at."""
        s: cython.Py_ssize_t = links._shape_count - links._part_count + row  # parts come last, in this order
        gap: cython.double = links.gap_at(s)
        if held is not None:
            p, q, t = links._shapes, held._in, self._tcp
            x: cython.double = (t[0] * q[9] + t[1] * q[10] + t[2] * q[11]) + t[9] - p[s, 9]
            y: cython.double = (t[3] * q[9] + t[4] * q[10] + t[5] * q[11]) + t[10] - p[s, 10]
            z: cython.double = (t[6] * q[9] + t[7] * q[10] + t[8] * q[11]) + t[11] - p[s, 11]
            apart: cython.double = sqrt(x * x + y * y + z * z) - held.touching._extent - links._extent[s]
            if apart < _SOON:  # then by their boxes
                solid, body = self._held_there(held, tcp), self._pieces.bodies[self.watched[row]]
                apart = between(held.part, solid.pose, body.part, body.pose)
            gap = min(gap, apart)
        if gap > _CLOSE:
            self._due[row] = self._way + gap - _CLOSE
        return gap

    @cython.cfunc
    def _held_there(self, held: Held, tcp: Any) -> object:
        """What is held, as a surface with the TCP there."""
        if self._solid is None:
            self._solid = solid_held(held, tcp)
        return self._solid

    @cython.cfunc
    def _look(self, held: Held | None, tcp: Any, joints: Any) -> object:
        """Find which parts are near the arm, or what it holds, of those whose distance may be another now."""
        pieces, links = self._pieces, self._load.links
        if self._seen != pieces.lying_changes or self.look_at_m == -_FAR:
            self._seen, self._known = pieces.lying_changes, {}
        known, near = self._known, {}
        next_m: cython.double = _FAR
        until: cython.double
        is_near: cython.bint
        for name in pieces.lying:
            body = pieces.bodies[name]
            is_near, until = known.get(name, (False, -_FAR))
            if until <= self._way + _SOON:
                extent: cython.double = body.part.shape.extent
                away: cython.double = links.away(body.pose.translation, joints) - extent
                if held is not None:
                    solid = self._held_there(held, tcp)
                    apart: cython.double = dist(body.pose.translation, solid.pose.translation)
                    away = min(away, apart - extent - cython.cast(cython.double, solid.shape.extent))
                is_near = away < (_GONE if is_near else _NEAR)
                until = self._way + (max(_GONE - away, _LOOK_AGAIN) if is_near else away - _LOOK_AGAIN)
                known[name] = bool(is_near), until
            if is_near:
                near[name] = solid_of(body)
            else:
                next_m = min(next_m, until)
        self.look_at_m: Any = next_m
        poses = {name: pieces.bodies[name].pose for name in near}
        # What a surface has brought here the arm feels first, as it does what it presses itself.
        self._brought_up = [name for name in near if self._poses.get(name, poses[name]) is not poses[name]]
        self._poses = poses
        self._watch(list(near))
        self._load.lay(near)
        return None

    @cython.cfunc
    def _push(self, near: Any, held: Held | None, tcp: Any, joints: Any) -> object:
        """A tick of parts on which something may press, or that move."""
        known, crowd = self._parts, self._pieces.crowd
        known.look()
        if held is None:
            crowd.hold(-1, None)
        else:
            by = (self._by[0], self._by[1], self._by[2])
            crowd.hold(known.numbers[held.part.name], self._held_there(held, tcp), self._brought, by)
        pushed = [known.numbers[name] for name in near if self._is_pushed(name, held, tcp, joints)]
        for gone in crowd.push(pushed):
            self._goes_on(gone)
        self._all_arrive()
        for part, link, deep_m in crowd.left:
            if known.names[part] in self._rows:
                self._load.links.leave(known.names[part], link, deep_m)
        if held is not None:
            # Where it is in parts that lie it feels these itself.
            bodies, names = self._pieces.bodies, known.names
            acting = [part for part in crowd.on_held if bodies[names[part]].state != LIES]
            total = sum([crowd.on_held[part] for part in acting]).tolist() if acting else None
            springs = [each for part in acting for each in crowd.springs[part]]
            held.touching.besides = None if total is None else (tuple(total[:3]), tuple(total[3:]), springs)
            held.touching.leave(crowd.unpressed, known.names)
            held.quiet = held.quiet and total is None and not crowd.unpressed
        return None

    @cython.cfunc
    @cython.exceptval(-1, check=True)
    def _is_pushed(self, name: str, held: Held | None, tcp: Any, joints: Any) -> cython.bint:
        """Whether a part that is near moves, or arm or held part press on it; what may press on it is told to
        the crowd."""
        pieces, parts = self._pieces, self._parts
        body = pieces.bodies[name]
        if pieces.face_below(name) is None:
            return False
        still: cython.bint = body.settled and not body.wound
        row: cython.Py_ssize_t = self._rows.get(name, -1)
        links: LinksBeside = self._load.surround(joints)
        near_m: cython.double = SEEN_M + self._soon + (0.0 if still else 2.0 * self._tick * fastest(body))
        pressing: list[PressingBall] = []
        if row >= 0:
            pressing = by_the_arm(body.part, links, joints, self._tick, near_m)
        stands_in: cython.bint = row >= 0 and links._muted[links._shape_count - links._part_count + row] != 0
        if held is not None:
            number = parts.numbers[held.part.name]
            pressing += by_what_is_held(held, number, self._held_there(held, tcp), body, near_m)
        deepest: cython.double = pieces.crowd.look(parts.numbers[name], pressing)
        deepest = max(deepest, -SEEN_M)
        if row >= 0:
            self._due[row] = self._way + (0.0 if stands_in else max(0.0, -deepest - _CLOSE))
        return not still or deepest > 0.0
