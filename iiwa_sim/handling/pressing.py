"""What may press on a part that lies: links, tool and jaws, and what these hold, which feels it too."""

from __future__ import annotations

from collections.abc import Iterator
from math import dist

from iiwa_sim.contact.link_forces_kernel import STIFFEST_N_PER_M
from iiwa_sim.contact.links_kernel import Links
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Transform, apply, compose
from iiwa_sim.handling.between_kernel import between
from iiwa_sim.handling.falling import STILL, Body
from iiwa_sim.handling.held import Held
from iiwa_sim.handling.meeting import NOWHERE, Ball, Meets, outline, remembering
from iiwa_sim.handling.part import Part
from iiwa_sim.handling.pushed import Key, Presser
from iiwa_sim.handling.touching import points_of
from iiwa_sim.motion.joints import Joints

SEEN_M = 0.05
"""So far from a part near the arm its distance is found exactly."""


def by_the_arm(part: Part, links: Links, joints: Joints, tick_s: float) -> Iterator[Presser]:
    """What of the arm, at joint positions (rad), may press on a part that its `links` know."""
    for middle, radius, rubbed, share, came in links.balls(part.name, joints, tick_s, SEEN_M):
        holding = share * min(part.stiffness, STIFFEST_N_PER_M)
        yield Presser(Ball(middle, radius, came=came), share * part.stiffness, part.friction, holding, rubbed)


def by_what_is_held(held: Held, solid: Surface, body: Body) -> Iterator[Presser]:
    """What of the held part, which is `solid` there, may press on a part, and the other way round."""
    part = held.part
    far = part.shape.extent + body.part.shape.extent + SEEN_M
    if dist(solid.pose.translation, body.pose.translation) > far:
        return
    both = in_a_row(part.stiffness, body.part.stiffness)
    points, own = points_of(part, upright=held.upright), solid_of(body)
    for number, place in enumerate(points.places):
        ball, key = Ball(apply(solid.pose, place), points.radius_m), (part.name, number)
        yield Presser(remembering(ball, own, body.came.get(key))[0], both / points.at_once, key=key)
    for key, each in _corners(held, solid, body):
        yield Presser(each, both, key=key)


def _corners(held: Held, solid: Surface, body: Body) -> Iterator[tuple[Key, Meets]]:
    """What of a part may press on the held one, which is `solid` there."""
    name, own = held.part.name, solid_of(body)
    for number, each in enumerate(outline(body.part, body.pose, 0.0, solid)):
        key = name, -1 - number
        yield key, remembering(each, own, body.came.get(key))[0]


def react(held: Held, solid: Surface, body: Body) -> None:
    """Add what corners of a part that lies do to the held part, which is `solid` there."""
    part, middle = held.part, solid.pose.translation
    if between(part, solid.pose, body.part, body.pose) > 0.0:
        return
    force, torque = held.touching.besides or (STILL, STILL)
    own, stiffness = solid_of(body), in_a_row(part.stiffness, body.part.stiffness)
    for _key, each in _corners(held, solid, body):
        depth, out, lever, _came = each.touch(own, NOWHERE)
        if depth <= 0.0:
            continue
        f = [stiffness * depth * component for component in out]
        r = [b + c - a for a, b, c in zip(middle, body.pose.translation, lever, strict=True)]
        force = (force[0] + f[0], force[1] + f[1], force[2] + f[2])
        torque = (
            torque[0] + r[1] * f[2] - r[2] * f[1],
            torque[1] + r[2] * f[0] - r[0] * f[2],
            torque[2] + r[0] * f[1] - r[1] * f[0],
        )
    if force != STILL:
        held.touching.besides = force, torque
        held.quiet = False


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
