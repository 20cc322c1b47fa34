"""Parts that lie, in the numbers in which `contact.crowd_kernel` pushes them, and where they are then."""

from __future__ import annotations

from math import hypot

from iiwa_sim.contact.crowd import LyingPart
from iiwa_sim.contact.places_kernel import STEP_M
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Transform, Vector, multiply
from iiwa_sim.handling.falling import FALLS, LIES, Body, landed
from iiwa_sim.handling.ground import Ground
from iiwa_sim.handling.pressing_kernel import solid_of
from iiwa_sim.handling.workpieces import Workpieces
from iiwa_sim.robot.trigonometry_kernel import cosine, sine

SLOW_M_PER_S = 1e-3
"""What nothing pushes, and is slower than this, rests."""
THERE_M = 1e-7
"""What comes to rest is no farther than this from the height at which it lies by itself."""
Way = tuple[float, float, float, float]
"""dx dy dz (m), and an angle about z (rad)."""


class Known:
    """What a crowd knows of the parts of a cell, and what stands there: kept as it is."""

    def __init__(self, pieces: Workpieces) -> None:
        """The crowd is that of the parts."""
        self._pieces = pieces
        self.names = list(pieces.bodies)
        self.numbers = {name: number for number, name in enumerate(self.names)}
        self._surfaces: tuple[Surface, ...] | None = None
        self._known: dict[str, Body] = {}
        self._laid = -1  # changes of what lies when all of that was laid
        self._ids: dict[str, int] = {}  # of surfaces

    def look(self) -> None:
        """Tell the crowd what is not as it was."""
        pieces = self._pieces
        bodies, lying, crowd = pieces.bodies, pieces.lying, pieces.crowd
        if self._surfaces != pieces.surfaces:
            self._surfaces = tuple(pieces.surfaces)
            first = len(self.names)
            ids = [self._ids.setdefault(each.name, first + len(self._ids)) for each in self._surfaces]
            crowd.stand(self._surfaces, ids)
            self._laid = -1
        if self._laid != pieces.lying_changes:
            self._laid = pieces.lying_changes
            for name in self.names:
                crowd.lay(self.numbers[name], None)
            changed = set(lying)
        else:
            changed = {name for name in pieces.put if self._known.get(name) is not bodies[name]}
        pieces.put.clear()
        for name in tuple(changed):
            on = bodies[name].on
            while on in self.numbers and on not in changed:
                changed.add(on)
                on = bodies[on].on
        there = [name for name in changed if bodies[name].state == LIES]
        for name in there:
            pieces.piles.weigh(self.numbers[name], bodies[name])
        for name in there:
            self._lay(bodies[name])

    def _lay(self, body: Body) -> None:
        pieces, part = self._pieces, body.part
        name = part.name
        face, on = pieces.face_below(name), self.numbers.get(body.on, -1)
        if on < 0 and self._surfaces is not None:
            surfaces = [each.name for each in self._surfaces]
            on = len(self.names) + surfaces.index(body.on) if body.on in surfaces else -1
        top = body.bottom if face is None else face.top
        below = part.stiffness if face is None else face.stiffness_below(part)
        mass, about = pieces.piles.carried(self.numbers[name])
        velocity = (*body.velocity, body.spin)
        laid = LyingPart(solid_of(body), velocity, body.wound, part.mass_kg, on, top, below, mass, about)
        pieces.crowd.lay(self.numbers[name], laid)
        self._known[name] = body


def ended(pieces: Workpieces, body: Body, face: Ground, pressed: bool) -> Body:
    """A part that has gone its way on a face in a tick, and on which something presses or not: it goes on,
    rests, comes to lie on what is beside, or falls."""
    x, y, _ = body.pose.translation
    if not face.has(x, y):
        flush = pieces.flush_with(face, x, y)
        if flush is not None:
            body, face = body._replace(on=flush.name), flush
        elif not pieces.keeps(body, face):
            return Body(body.part, body.pose, body.velocity, FALLS)
    if body.bottom - face.top > STEP_M:
        return Body(body.part, body.pose, body.velocity, FALLS)
    if not pressed and fastest(body) < SLOW_M_PER_S:
        rests = landed(body, face)
        rises_m = rests.bottom - body.bottom
        if rises_m > 0.0 and pieces.is_below(body.part.name):  # these keep it down
            return rests._replace(pose=body.pose)
        if abs(rises_m) < THERE_M:  # else it only turns round on its spring
            return rests
    return body


def gone_by(pose: Transform, way: Way) -> Transform:
    """A pose after a way."""
    (x, y, z), rotation = pose.translation, pose.rotation
    if way[3] != 0.0:
        c, s = cosine(way[3]), sine(way[3])
        rotation = multiply((c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0), rotation)
    return Transform(rotation, (x + way[0], y + way[1], z + way[2]))


def turned(place: Vector, angle: float) -> Vector:
    """A place (m), turned about z (rad)."""
    if angle == 0.0:
        return place
    c, s = cosine(angle), sine(angle)
    x, y, z = place
    return (c * x - s * y, s * x + c * y, z)


def offset(start: Vector, end: Vector) -> Vector:
    """The way (m) from a place to another."""
    return (end[0] - start[0], end[1] - start[1], end[2] - start[2])


def fastest(body: Body) -> float:
    """No point of it is faster (m/s)."""
    x, y, z = body.velocity
    return hypot(x, y, z) + abs(body.spin) * body.part.shape.extent
