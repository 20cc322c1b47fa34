"""What may press on a part that lies: links, tool and jaws, and what these hold."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from math import dist

import cython

from iiwa_sim.contact.crowd import PressingBall
from iiwa_sim.contact.link_friction_kernel import STIFFEST_N_PER_M
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.ways_in_kernel import NOT_IN
from iiwa_sim.frames import Transform, compose
from iiwa_sim.handling.falling import Body
from iiwa_sim.handling.part import Part
from iiwa_sim.motion.joints import Joints

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.links_beside_kernel import LinksBeside
    from cython.cimports.iiwa_sim.handling.held_kernel import Held
    from cython.cimports.iiwa_sim.handling.touching_kernel import Touching
    from cython.cimports.iiwa_sim.robot.record_kernel import record
else:
    from iiwa_sim.contact.links_beside_kernel import LinksBeside
    from iiwa_sim.handling.held_kernel import Held
    from iiwa_sim.handling.touching_kernel import Touching
    from iiwa_sim.robot.record_kernel import record

SEEN_M = 0.005
"""Distance of a part up to which it is found exactly, where neither it nor the arm moves; else it is more by
twice what they go in a tick."""
NO_WAY = (0.0, 0.0, 0.0)


def by_the_arm(
    part: Part, links: LinksBeside, joints: Joints, tick_s: float, near_m: float = SEEN_M
) -> list[PressingBall]:
    """What of the arm, at joint positions (rad), may press on a part that its `links` know: what is no
    farther from it than so (m)."""
    found = []
    for ball in links.balls(part.name, joints, tick_s, near_m):
        middle, radius, rubbed, share, came, was_deep, went, link, unpressed, rubs, start, line = ball
        holding = share * min(part.stiffness, STIFFEST_N_PER_M)
        law = share * part.stiffness, part.friction if rubs else 0.0, holding
        place = rubbed, came, -1, link, was_deep, went, start, line, unpressed, None, NO_WAY
        found.append(record(PressingBall, (middle, radius, *law, *place)))
    return found


def by_what_is_held(
    held: Held, number: int, solid: Surface, body: Body, near_m: float = SEEN_M
) -> list[PressingBall]:
    """What of the held part, which is `solid` there, may press on a part: nothing where they are farther
    apart than so (m)."""
    part, found = held.part, []
    far = part.shape.extent + body.part.shape.extent + near_m
    if dist(solid.pose.translation, body.pose.translation) > far:
        return []
    touching: Touching = held.touching
    radius_m, at_once = touching.points.radius_m, touching.points.at_once
    stiffness = in_a_row(part.stiffness, body.part.stiffness) / at_once
    others = -1.0, NO_WAY, NO_WAY, NO_WAY, 0.0  # the crowd itself knows
    close = touching.at(body.part.name, solid.pose)
    p, own = touching._pose, touching._own
    place: cython.Py_ssize_t
    for place in range(own.shape[0]):
        x: cython.double = (p[0] * own[place, 0] + p[1] * own[place, 1] + p[2] * own[place, 2]) + p[9]
        y: cython.double = (p[3] * own[place, 0] + p[4] * own[place, 1] + p[5] * own[place, 2]) + p[10]
        z: cython.double = (p[6] * own[place, 0] + p[7] * own[place, 1] + p[8] * own[place, 2]) + p[11]
        middle, contact, rubbed = close.get(place) or ((x, y, z), None, None)
        law = stiffness, 0.0 if rubbed is None else part.friction, stiffness  # as `touching` has it
        rolls = rubbed is not None and radius_m > 0.0
        turned = touching.worlds[place].turned(solid.pose.rotation) if rolls else NO_WAY
        which = rubbed or NO_WAY, NOT_IN, number, place, *others, contact, turned
        found.append(record(PressingBall, (middle, radius_m, *law, *which)))
    return found


def solid_of(body: Body) -> Surface:
    """A part that lies, as a surface."""
    part = body.part
    return Surface(part.name, part.shape, body.pose, part.stiffness, 0.0, part.friction)


def solid_held(held: Held, tcp: Transform) -> Surface:
    """The held part as a surface, with the TCP at that pose."""
    part = held.part
    return Surface(part.name, part.shape, compose(tcp, held.in_tcp), part.stiffness, 0.0, 0.0)


def in_a_row(one: float, other: float) -> float:
    """Stiffness of both in a row (N/m)."""
    return 1.0 / (1.0 / one + 1.0 / other)
