"""What a part that lies may meet as it is pushed: surfaces, and other parts that lie beside it."""

from __future__ import annotations

from collections.abc import Iterator
from math import dist

from iiwa_sim.contact.shapes import Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.handling.between_kernel import between
from iiwa_sim.handling.falling import Body
from iiwa_sim.handling.ground import Ground
from iiwa_sim.handling.meeting import NOWHERE, STEP_M, Meets, Rim, meets, remembering
from iiwa_sim.handling.part import Part
from iiwa_sim.handling.pressing import in_a_row, solid_of
from iiwa_sim.handling.pushed import Presser
from iiwa_sim.handling.workpieces import Workpieces

AT_ONCE = 0.25
"""Part of the stiffness that each place has at which a part meets what is beside it: several meet at once."""
LEVELS = 3
"""A cylinder that stands meets it at so many; a ball at one place."""


def in_the_way(pieces: Workpieces, body: Body, face: Ground, reach_m: float) -> Iterator[Presser]:
    """What of surfaces and other parts that lie a part on a `face` may meet in a tick in which it goes no
    farther than that."""
    name = body.part.name
    lift_m = STEP_M + max(0.0, face.top - body.bottom)
    for surface in pieces.surfaces:
        if surface.name != body.on:
            yield from _of(body, lift_m, surface, reach_m, body.part.friction)
    riding = {each.part.name for each in pieces.riders(name)}
    for other in beside(pieces, name, reach_m):
        if other != body.on and other not in riding:
            yield from _of(body, lift_m, solid_of(pieces.bodies[other]), reach_m, 0.0)


def beside(pieces: Workpieces, name: str, reach_m: float) -> list[str]:
    """The names of parts that lie and are perhaps no farther from one than that (m)."""
    bodies, own = pieces.bodies, pieces.bodies[name]
    middle, far_m = own.pose.translation, own.part.shape.extent + reach_m
    return [
        other
        for other in pieces.lying
        if other != name
        and dist(middle, bodies[other].pose.translation) <= far_m + bodies[other].part.shape.extent
        and between(own.part, own.pose, bodies[other].part, bodies[other].pose) <= reach_m
    ]


def _of(body: Body, lift_m: float, other: Surface, reach_m: float, friction: float) -> Iterator[Presser]:
    both, solid = in_a_row(other.stiffness, body.part.stiffness), solid_of(body)
    for number, each in enumerate(meets(body.part, body.pose, lift_m, other, reach_m)):
        key = other.name, number
        meeting, rubbed = remembering(each, solid, body.came.get(key))
        stiffness = both * _share(body.part, each)
        if meeting.touch(solid, NOWHERE).depth > -reach_m:
            yield Presser(meeting, stiffness, friction, stiffness, rubbed, key)


def _share(part: Part, each: Meets) -> float:
    """Of the stiffness, that one of several places has."""
    if isinstance(each, Rim):
        return 1.0 if isinstance(part.shape, Sphere) else 1.0 / LEVELS
    return AT_ONCE
