"""Which parts that lie are pushed in a tick: by the arm, by what it holds, and by each other.

**Cost.** Parts are looked for near the arm when it has gone so far that another could be near; of those that
are, each is looked at closely when the arm has gone so far that it could touch it. So parts far away cost
nothing, however many there are.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import dist, hypot, inf

from iiwa_sim.contact.crowd import Gone, Presses
from iiwa_sim.contact.load_kernel import ExternalLoad
from iiwa_sim.contact.places_kernel import STEP_M
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import IDENTITY, Transform
from iiwa_sim.handling.between_kernel import between
from iiwa_sim.handling.falling import FALLS, LIES, STILL, Body, landed
from iiwa_sim.handling.ground import Ground
from iiwa_sim.handling.held import Held
from iiwa_sim.handling.pressing import SEEN_M, by_the_arm, by_what_is_held, solid_held, solid_of
from iiwa_sim.handling.pushed import SLOW_M_PER_S, Known, Way, gone_by, turned
from iiwa_sim.handling.workpieces import Workpieces
from iiwa_sim.motion.joints import Joints

NEAR_M = 0.2
"""Parts farther from the arm are not looked at until it has come nearer."""
GONE_M = 0.4
"""Those that have been nearer are looked at until they are so far from it: what changes is dear."""
LOOK_AGAIN_M = 0.05
"""Way of the arm after which parts are looked for; nearer than so each of them is known."""
SOON_M = 0.03
"""What is to be looked for within this way is looked for with what is to be now."""
CLOSE_M = 5e-4
"""What is farther from a part, and not on its way in a tick, does not touch it."""


class Aside:
    """The parts that lie, as the arm and what it holds push them, tick by tick."""

    def __init__(self, pieces: Workpieces, load: ExternalLoad, tick_s: float) -> None:
        """What is pushed is put into `pieces`, and told to `load`, which feels it."""
        self._pieces = pieces
        self._load = load
        self._tick_s = tick_s
        self._parts = Known(pieces)
        self._joints: Joints | None = None  # of the last tick
        self._opening_m = 0.0
        self._in_jaws: Held | None = None  # then, and where the TCP was, and it in that
        self._tcp = self._in_tcp = IDENTITY
        self._way_m = 0.0  # no point of the arm, or of what it holds, has gone farther
        self._look_at_m = 0.0  # where on that way parts are looked for
        self._seen = -1  # the number of changes of parts then
        self._known: dict[str, tuple[bool, float]] = {}  # whether each is near, and until where on the way
        self._due: dict[str, float] = {}  # parts near the arm: where on the way each is looked at
        self._next_m = -inf  # where on the way the first of them is
        self._held: tuple[Held, Surface] | None = None  # in this tick
        self._calm = False  # a tick in which arm and parts stayed as they were has changed nothing
        self._changes = -1  # of the parts, when the last tick ended

    def forget(self) -> None:
        """Arm or parts have been put elsewhere."""
        self._joints, self._seen, self._calm = None, -1, False
        self._load.lay({})
        self._due = {}

    def step(self, tcp: Transform, joints: Joints, opening_m: float) -> None:
        """A tick has brought the arm to `joints` (rad), with its TCP there and its jaws so far apart."""
        pieces = self._pieces
        pieces.pushed.clear()
        stays = self._changes == pieces.changes and joints == self._joints and opening_m == self._opening_m
        if stays and self._calm:
            return
        held = pieces.in_jaws
        if held is not None:
            held.touching.besides = None
        if not pieces.lying:
            if self._due:
                self.forget()
            return
        moving = pieces.moving
        self._goes(held, tcp, joints, opening_m)
        if moving:
            self._way_m += self._tick_s * max(_speed(pieces.bodies[name]) for name in moving)
        looks = self._seen != pieces.lying_changes or self._way_m >= self._look_at_m
        if not (looks or moving or self._way_m >= self._next_m):
            self._calm, self._changes = stays, pieces.changes
            return
        self._held = None if held is None else (held, solid_held(held, tcp))
        if looks:
            self._look(joints)
        # In the order of the cell: what becomes of them must not depend on when they were looked at.
        due = {name for name, due in self._due.items() if due <= self._way_m}.union(moving)
        waiting = [name for name in pieces.lying if name in due]
        crowd, known = pieces.crowd, self._parts
        known.look()
        if self._held is None:
            crowd.hold(-1, None)
        else:
            crowd.hold(known.numbers[self._held[0].part.name], self._held[1])
        pushed = [known.numbers[name] for name in waiting if self._is_pushed(name, joints)]
        for gone in crowd.push(pushed):
            self._goes_on(gone)
        if self._held is not None:
            known.look()
            force, torque = crowd.on_held()
            if force != STILL:
                self._held[0].touching.besides = force, torque
                self._held[0].quiet = False
        self._next_m = min(self._due.values(), default=inf)
        self._calm, self._changes = stays and self._changes == pieces.changes, pieces.changes

    def _goes(self, held: Held | None, tcp: Transform, joints: Joints, opening_m: float) -> None:
        """Add to the way what arm and jaws have gone, or what they hold, whichever is more."""
        way_m = 0.0
        if joints != self._joints or opening_m != self._opening_m:
            way_m = self._load.links.goes(joints)
        if self._joints is None or held is not self._in_jaws:
            self._look_at_m = self._next_m = -inf
            self._due = dict.fromkeys(self._due, -inf)
        elif held is not None:
            way_m = max(way_m, held.way_since(self._tcp, self._in_tcp, tcp))
        self._way_m += way_m
        self._joints, self._opening_m, self._in_jaws, self._tcp = joints, opening_m, held, tcp
        if held is not None:
            self._in_tcp = held.in_tcp

    def _look(self, joints: Joints) -> None:
        """Find which parts are near the arm, or what it holds, of those whose distance may be another now."""
        pieces, links = self._pieces, self._load.links
        if self._seen != pieces.lying_changes or self._look_at_m == -inf:
            self._seen, self._known = pieces.lying_changes, {}
        known, near, next_m = self._known, {}, inf
        for name in pieces.lying:
            body = pieces.bodies[name]
            is_near, until_m = known.get(name, (False, -inf))
            if until_m <= self._way_m + SOON_M:
                middle, extent = body.pose.translation, body.part.shape.extent
                away_m = links.away(middle, joints) - extent
                if self._held is not None:
                    solid = self._held[1]
                    away_m = min(away_m, dist(middle, solid.pose.translation) - extent - solid.shape.extent)
                is_near = away_m < (GONE_M if is_near else NEAR_M)
                stays_m = max(GONE_M - away_m, LOOK_AGAIN_M)
                until_m = self._way_m + (stays_m if is_near else away_m - LOOK_AGAIN_M)
                known[name] = is_near, until_m
            if is_near:
                near[name] = solid_of(body)
            else:
                next_m = min(next_m, until_m)
        self._look_at_m = next_m
        self._due = {name: self._due.get(name, -inf) for name in near}
        self._load.lay(near)

    def _is_pushed(self, name: str, joints: Joints) -> bool:
        """Whether a part moves, or arm or held part press on it; what may press on it is told to the
        crowd."""
        pieces = self._pieces
        body = pieces.bodies[name]
        if body.state != LIES or pieces.face_below(name) is None:
            return False
        still = body.settled and not body.wound
        if still:
            gap_m = self._gap(body, joints)
            if gap_m > CLOSE_M:
                self._due[name] = self._way_m + gap_m - CLOSE_M
                return False
        pressing: list[Presses] = []
        if name in self._due:
            pressing += by_the_arm(body.part, self._load.surround(joints), joints, self._tick_s)
        if self._held is not None:
            held, solid = self._held
            pressing += by_what_is_held(held, self._parts.numbers[held.part.name], solid, body)
        deepest = max(pieces.crowd.look(self._parts.numbers[name], pressing, still), -SEEN_M)
        if name in self._due:
            self._due[name] = self._way_m if deepest > -CLOSE_M else self._way_m - deepest - CLOSE_M
        return not still or deepest > 0.0

    def _goes_on(self, gone: Gone) -> None:
        """A part has gone its way in this tick."""
        pieces, name = self._pieces, self._parts.names[gone.part]
        body, face, (x, y, z, spin) = pieces.bodies[name], pieces.face_below(name), gone.velocity
        if body.state != LIES or face is None:
            return
        pieces.pushed.add(name)
        pose = gone_by(body.pose, gone.way) if any(gone.way) else body.pose
        after = self._ends(
            body._replace(pose=pose, velocity=(x, y, z), spin=spin, wound=gone.wound), face, gone.pressed
        )
        if after != body:
            self._put(after, body, list(pieces.riders(name)), gone.way)

    def _gap(self, body: Body, joints: Joints) -> float:
        """How far (m) a part is at least from the arm, and from what that holds."""
        name, gap_m = body.part.name, inf
        if name in self._due:
            gap_m = self._load.surround(joints).gap_to(name)
        if self._held is not None:
            held, solid = self._held
            gap_m = min(gap_m, between(held.part, solid.pose, body.part, body.pose))
        return gap_m

    def _ends(self, body: Body, face: Ground, pressed: bool) -> Body:
        """A part that has gone its way: it goes on, rests, comes to lie on what is beside, or falls."""
        x, y, _ = body.pose.translation
        if not face.has(x, y):
            flush = self._pieces.flush_with(face, x, y)
            if flush is None:
                return Body(body.part, body.pose, body.velocity, FALLS)
            body, face = body._replace(on=flush.name), flush
        if body.bottom - face.top > STEP_M:
            return Body(body.part, body.pose, body.velocity, FALLS)
        if not pressed and _speed(body) < SLOW_M_PER_S:
            return landed(body, face)
        return body

    def _put(self, after: Body, before: Body, riders: Sequence[Body], way: Way) -> None:
        """A part is there now, with what lies on it; the arm is told."""
        pieces, middle = self._pieces, before.pose.translation
        pieces.put_aside(after)
        self._tell(after, before)
        if after.state == FALLS:
            return
        for each in riders:
            off = tuple(a - b for a, b in zip(each.pose.translation, middle, strict=True))
            x, y, _ = turned((off[0], off[1], off[2]), way[3])
            turn = (x - off[0], y - off[1], 0.0)
            gone: Way = (way[0] + turn[0], way[1] + turn[1], way[2], way[3])
            now = each._replace(pose=gone_by(each.pose, gone))
            pieces.put_aside(now)
            self._tell(now, each)

    def _tell(self, after: Body, before: Body) -> None:
        """The arm feels a part that is near it where that is now."""
        name = after.part.name
        if name in self._due and after.state == LIES and after.pose != before.pose:
            dx, dy, dz = (a - b for a, b in zip(after.pose.translation, before.pose.translation, strict=True))
            r, q = after.pose.rotation, before.pose.rotation
            # By the sine, which is the angle in a tick, of the axes before and now.
            turn = 0.5 * (
                (q[0] * r[3] - q[3] * r[0]) + (q[1] * r[4] - q[4] * r[1]) + (q[2] * r[5] - q[5] * r[2])
            )
            self._load.shift(name, solid_of(after), (dx, dy, dz, turn))


def _speed(body: Body) -> float:
    """No point of it is faster (m/s)."""
    x, y, z = body.velocity
    return hypot(x, y, z) + abs(body.spin) * body.part.shape.extent
