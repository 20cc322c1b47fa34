"""How a part falls, lands, slides and comes to rest: closed forms from event to event.

It does not tumble: in the air it is turned as it was let go of, and where it lands it is laid on the face
that is nearest to below. It does not bounce: its speed into the face is lost, and so is, of the speed along
it, as much times the coefficient of friction. It lies where its middle is above a level face, or where it is
pressed into one from above as it is let go of, and is pressed in by its weight over the stiffness. Nothing
here gains energy.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, sqrt
from typing import NamedTuple

from iiwa_sim.contact.moments import GRAVITY_M_S2
from iiwa_sim.frames import Transform, Vector
from iiwa_sim.handling.ground import Ground
from iiwa_sim.handling.part import Part, Z

FARTHEST_M = 100.0
"""From the base: what falls or slides further is gone."""
DEEPEST_M = -10.0
"""Height below which it is gone."""
STILL: Vector = (0.0, 0.0, 0.0)
LIES, FALLS, HELD, GONE = "lies", "falls", "held", "gone"
HALVINGS = 50
"""Of a time in which a part slides over an edge."""
_ROUNDING_M = 1e-9
MOST_EVENTS = 8
"""In a tick; what is left then waits for the next."""


class Body(NamedTuple):
    """A part in one tick."""

    part: Part
    pose: Transform
    """Of its middle, in the base."""
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


def moved(body: Body, faces: Sequence[Ground], time_s: float) -> Body:
    """After a time; `faces` are those of what there is besides itself."""
    left = time_s
    for _ in range(MOST_EVENTS):
        if left <= 0.0 or body.settled:
            break
        if body.state == LIES:
            face = next((each for each in faces if each.name == body.on), None)
            body, left = (
                (body._replace(state=FALLS, spin=0.0, wound=(), on=""), left)
                if face is None
                else _slid(body, face, left)
            )
        else:
            body, left = _fallen(body, faces, left)
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


def ridden(body: Body, faces: Sequence[Ground]) -> Body:
    """What lies, after surfaces have moved: taken along upwards by the face on which it lies, or it falls."""
    (x, y, z), bottom = body.pose.translation, body.bottom
    face = next((each for each in faces if each.name == body.on and each.has(x, y)), None)
    if face is None:
        return body._replace(state=FALLS, spin=0.0, wound=(), on="")
    if any(face.top < each.top <= z and bottom < each.top and each.has(x, y) for each in faces):
        return body._replace(state=FALLS, spin=0.0, wound=(), on=body.on)  # onto what has come in between
    up = landed(body, face)
    rises_m = up.pose.translation[2] - z
    if body.wound and abs(rises_m) < 1e-3:
        return body  # it is pushed, and perhaps pressed in
    if rises_m < -_ROUNDING_M:
        return body._replace(state=FALLS, spin=0.0, wound=(), on=body.on)
    return body if rises_m <= _ROUNDING_M else up._replace(velocity=body.velocity)


def _fallen(body: Body, faces: Sequence[Ground], left: float) -> tuple[Body, float]:
    """In the air up to when it lands, or for as long as is left; and what then is left."""
    (x, y, z), (vx, vy, vz) = body.pose.translation, body.velocity
    bottom = body.bottom
    first, on = inf, None
    for face in faces:
        if face.top > z and face.name != body.on:
            continue  # its middle is below already: it falls past
        height = max(0.0, bottom - face.top)
        time = (vz + sqrt(vz * vz + 2.0 * GRAVITY_M_S2 * height)) / GRAVITY_M_S2
        if bottom < face.top:
            time = 0.0
        if time <= left and time < first and face.has(x + vx * time, y + vy * time):
            first, on = time, face
    time = min(first, left)
    z += vz * time - 0.5 * GRAVITY_M_S2 * time * time
    vz -= GRAVITY_M_S2 * time
    pose = Transform(body.pose.rotation, (x + vx * time, y + vy * time, z))
    body = body._replace(pose=pose, velocity=(vx, vy, vz), on="")
    if on is None:
        return body, 0.0
    speed = sqrt(vx * vx + vy * vy)
    lost = body.part.friction * max(0.0, -vz)
    share = 1.0 - lost / speed if speed > lost else 0.0
    return landed(body, on)._replace(velocity=(share * vx, share * vy, 0.0)), left - time


def _slid(body: Body, face: Ground, left: float) -> tuple[Body, float]:
    """Along a face until it rests, or its middle is over the edge; and what then is left of the time."""
    (x, y, z), (vx, vy, _) = body.pose.translation, body.velocity
    speed = sqrt(vx * vx + vy * vy)
    braking = body.part.friction * GRAVITY_M_S2
    time = min(left, speed / braking) if braking > 0.0 else left

    def after(passed: float) -> tuple[float, float]:
        way = passed - 0.5 * braking * passed * passed / speed
        return x + vx * way, y + vy * way

    over = not face.has(*after(time))
    if over:
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
