"""What a part that lies may meet as it is pushed: surfaces, and other parts that lie beside it."""

from __future__ import annotations

from collections.abc import Iterator
from math import dist

from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Transform
from iiwa_sim.handling.falling import Body
from iiwa_sim.handling.ground import Ground
from iiwa_sim.handling.meeting import STEP_M, meets
from iiwa_sim.handling.part import Part, X, Y, Z
from iiwa_sim.handling.pressing import NOWHERE, in_a_row, solid_of
from iiwa_sim.handling.pushed import Presser
from iiwa_sim.handling.workpieces import Workpieces

AT_ONCE = 0.25
"""Part of the stiffness that each place has at which a part meets what is beside it: several meet at once."""


def in_the_way(pieces: Workpieces, body: Body, face: Ground, reach_m: float) -> Iterator[Presser]:
    """What of surfaces and other parts that lie a part on a `face` may meet in a tick in which it goes no
    farther than that."""
    name = body.part.name
    lift_m = STEP_M + max(0.0, face.top - body.bottom)
    for surface in pieces.surfaces:
        if surface.name != body.on:
            yield from _of(body, lift_m, surface, reach_m)
    riding = {each.part.name for each in pieces.riders(name)}
    for other in beside(pieces, name, reach_m):
        if other != body.on and other not in riding:
            yield from _of(body, lift_m, solid_of(pieces.bodies[other]), reach_m)


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


def between(one: Part, place: Transform, other: Part, there: Transform) -> float:
    """Two parts are no nearer to each other (m), by the boxes round them along the axes of the base."""
    return max(
        abs(place.translation[axis] - there.translation[axis])
        - one.reach(place.rotation, axis)
        - other.reach(there.rotation, axis)
        for axis in (X, Y, Z)
    )


def _of(body: Body, lift_m: float, other: Surface, reach_m: float) -> Iterator[Presser]:
    both, solid = in_a_row(other.stiffness, body.part.stiffness), solid_of(body)
    for each in meets(body.part, body.pose, lift_m, other, reach_m):
        if each.touch(solid, NOWHERE).depth > -reach_m:
            yield Presser(each, AT_ONCE * both)
