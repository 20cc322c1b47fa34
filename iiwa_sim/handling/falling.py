"""How a part falls, lands, slides and comes to rest: closed forms from event to event.

It does not tumble: in the air it is turned as it was let go of, and where it lands it is laid on the face
that is nearest to below. It does not bounce: its speed into the face is lost, and so is, of the speed along
it, as much times the coefficient of friction. It lies where its middle is above a level face, or where it is
pressed into one from above as it is let go of, and is pressed in by its weight over the stiffness. What
passes a part with its middle beside that is moved out of it sideways, and so is what lands with some of
itself in what stands there; what has no room beside something lies on that. Nothing here gains energy.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, sqrt
from typing import NamedTuple

from iiwa_sim.contact.moments import GRAVITY_M_S2
from iiwa_sim.frames import Transform, Vector
from iiwa_sim.handling.ground import Ground
from iiwa_sim.handling.part import Part, Z
from iiwa_sim.handling.room import Outline, between_heights, outline_of, way_to_room

FARTHEST_M = 100.0
"""Distance from the base: what falls or slides further is gone."""
DEEPEST_M = -10.0
"""Height below which it is gone."""
STILL: Vector = (0.0, 0.0, 0.0)
LIES, FALLS, HELD, GONE = "lies", "falls", "held", "gone"
HALVINGS = 50
"""How often the time in which a part slides over an edge is halved."""
_ROUNDING_M = 1e-9
LEVEL_M = 1e-3
"""What is higher or lower by no more than this is as high."""
MOST_EVENTS = 8
"""Most events of one part in a tick; what is left then waits for the next."""


class Body(NamedTuple):
    """A part in one tick."""

    part: Part
    pose: Transform
    """Pose of the part's middle, in the base."""
    velocity: Vector
    """m/s"""
    state: str
    """`LIES` also while it slides, `FALLS`, `HELD`, `GONE`."""
    on: str = ""
    """Name of what it lies on; of what begins to fall, of the face into which it is pressed from above."""
    spin: float = 0.0
    """How fast it turns about the vertical (rad/s): only of one that lies."""
    wound: tuple[float, ...] = ()
    """How far friction's springs below one that is pushed are wound: x and y of four places (m)."""

    @property
    def settled(self) -> bool:
        """Whether it stays where it is for itself."""
        still = self.velocity == STILL and self.spin == 0.0
        return self.state in (GONE, HELD) or (self.state == LIES and still)

    @property
    def bottom(self) -> float:
        """Height of its lowest point (m)."""
        return self.pose.translation[2] - self.part.reach(self.pose.rotation, Z)


def sag(part: Part, face: Ground) -> float:
    """How deep (m) a part lies in a face."""
    return part.mass_kg * GRAVITY_M_S2 / face.stiffness_below(part)


def moved(body: Body, faces: Sequence[Ground], time_s: float, beside: Sequence[Outline] = ()) -> Body:
    """Where a part is after a time; `faces` are those of what there is besides itself, and `beside` is all of
    that from above."""
    left = time_s
    passed: set[str] = set()
    for _ in range(MOST_EVENTS):
        if left <= 0.0 or body.settled:
            break
        if body.state == LIES:
            face = next((each for each in faces if each.name == body.on), None)
            body, left = (
                (body._replace(state=FALLS, spin=0.0, wound=(), on=""), left)
                if face is None
                else _slid(body, face, left, beside)
            )
        else:
            body, left = _fallen(body, faces, left, beside, passed)
    x, y, z = body.pose.translation
    if z < DEEPEST_M or max(abs(x), abs(y)) > FARTHEST_M:
        return body._replace(state=GONE, velocity=STILL, on="")
    return body


def landed(body: Body, face: Ground) -> Body:
    """Laid on a face, where it is, at rest."""
    (x, y, _), part = body.pose.translation, body.part
    rotation = part.laid(body.pose.rotation)
    z = face.top - sag(part, face) + part.reach(rotation, Z)
    pose = Transform(rotation, (x, y, z))
    return Body(part, pose, STILL, LIES, face.name)


def has_no_room(body: Body, name: str, beside: Sequence[Outline]) -> bool:
    """Whether a part as low as something would be in that, or else in what is beside."""
    own = _outline(body)
    its = next((each for each in beside if each.name == name), None)
    return own is not None and its is not None and own.is_in(its) and _aside(own, its.top, beside) is None


def _outline(body: Body) -> Outline | None:
    """A part as it will lie, from above."""
    part = body.part
    pose = Transform(part.laid(body.pose.rotation), body.pose.translation)
    return outline_of(part.name, part.shape, pose, part.stiffness)


def _aside(own: Outline, low: float, beside: Sequence[Outline]) -> tuple[float, float] | None:
    """The way (m) to room beside what is no lower than `low`, for a part whose lowest place that is."""
    return way_to_room(own, between_heights(beside, low - LEVEL_M, low + own.top - own.low))


def _fallen(
    body: Body, faces: Sequence[Ground], left: float, beside: Sequence[Outline], passed: set[str]
) -> tuple[Body, float]:
    """A part in the air up to when it lands, passes something, or for as long as is left; and what then is
    left."""
    (x, y, z), (vx, vy, vz) = body.pose.translation, body.velocity
    bottom = body.bottom

    def when(face: Ground | Outline, deep: float) -> float:
        """When the lowest place of the part has come down to a face."""
        if bottom < face.top:
            return 0.0 if bottom >= face.top - deep - _ROUNDING_M else inf
        return (vz + sqrt(vz * vz + 2.0 * GRAVITY_M_S2 * (bottom - face.top))) / GRAVITY_M_S2

    first, on, by = inf, None, None
    # Surely below all that it comes to in this time. Where its middle is below something, it falls past that.
    low = bottom + min(0.0, vz) * left - GRAVITY_M_S2 * left * left - _ROUNDING_M
    for face in [each for each in faces if low <= each.top <= z or each.name == body.on]:
        time = when(face, inf if face.name == body.on else sag(body.part, face))
        if time <= left and time < first and face.has(x + vx * time, y + vy * time):
            first, on = time, face
    for each in [each for each in beside if low <= each.top <= z]:
        if each.name in passed:
            continue
        time = when(each, 0.0 if each.face is None else sag(body.part, each.face))
        if time <= left and time < first:
            own = _outline(body)
            if own is not None and own.gone((vx * time, vy * time)).is_in(each):
                first, on, by = time, None, each
    time = min(first, left)
    z += vz * time - 0.5 * GRAVITY_M_S2 * time * time
    vz -= GRAVITY_M_S2 * time
    pose = Transform(body.pose.rotation, (x + vx * time, y + vy * time, z))
    body = body._replace(pose=pose, velocity=(vx, vy, vz), on="")
    if by is not None:
        passed.add(by.name)
        body, on = _passed(body, by, beside)
    if on is None:
        return body, left - time
    speed = sqrt(vx * vx + vy * vy)
    lost = body.part.friction * max(0.0, -vz)
    share = 1.0 - lost / speed if speed > lost else 0.0
    lies = landed(body, on)
    own = _outline(lies)
    others = [each for each in beside if each.name != on.name and each.top > on.top + LEVEL_M]
    way = None if own is None else way_to_room(own, between_heights(others, own.low, own.top), lands=True)
    if way is not None and way != (0.0, 0.0):
        if not on.has(lies.pose.translation[0] + way[0], lies.pose.translation[1] + way[1]):
            return _gone_aside(body, way), left - time
        lies = _gone_aside(lies, way)
    return lies._replace(velocity=(share * vx, share * vy, 0.0)), left - time


def _passed(body: Body, by: Outline, beside: Sequence[Outline]) -> tuple[Body, Ground | None]:
    """A part comes past something with its middle beside: moved out of it, where that is a part; and the
    face on which it lies for want of room."""
    own = _outline(body)
    way = None if own is None else _aside(own, by.top, beside)
    if way is None:
        return body, by.face
    return (_gone_aside(body, way) if by.is_part else body), None


def _gone_aside(body: Body, way: tuple[float, float]) -> Body:
    """Moved out of something; its speed into that is lost."""
    (x, y, z), (vx, vy, vz) = body.pose.translation, body.velocity
    into = (vx * way[0] + vy * way[1]) / (way[0] * way[0] + way[1] * way[1])
    if into < 0.0:
        vx, vy = vx - into * way[0], vy - into * way[1]
    pose = Transform(body.pose.rotation, (x + way[0], y + way[1], z))
    return body._replace(pose=pose, velocity=(vx, vy, vz))


def _slid(body: Body, face: Ground, left: float, beside: Sequence[Outline]) -> tuple[Body, float]:
    """A part that slides until it rests, or its middle is over the edge of the face and there is room beside;
    and what then is left of the time."""
    (x, y, z), (vx, vy, _) = body.pose.translation, body.velocity
    speed = sqrt(vx * vx + vy * vy)
    braking = body.part.friction * GRAVITY_M_S2
    time = min(left, speed / braking) if braking > 0.0 else left

    def after(passed: float) -> tuple[float, float]:
        way = passed - 0.5 * braking * passed * passed / speed
        return x + vx * way, y + vy * way

    over = not face.has(*after(time))
    if over and not face.has(x, y):
        there = body._replace(pose=Transform(body.pose.rotation, (*after(time), z)))
        over = not has_no_room(there, face.name, beside)
    elif over:
        low, high = 0.0, time
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if face.has(*after(middle)) else (low, middle)
        time = high
    rest = not over and time < left
    share = 0.0 if rest else max(0.0, 1.0 - braking * time / speed)
    x, y = after(time)
    body = body._replace(
        pose=Transform(body.pose.rotation, (x, y, z)), velocity=(share * vx, share * vy, 0.0)
    )
    if over:
        return body._replace(state=FALLS, spin=0.0, wound=(), on=""), left - time
    return body, left - time
