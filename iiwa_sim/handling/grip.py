"""Where jaws close on a part."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import cos, dist, inf, radians, sin, sqrt
from typing import NamedTuple

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.frames import Transform, Vector, compose, inverse
from iiwa_sim.handling.gripper import Gripper, Jaws
from iiwa_sim.handling.part import Part, X, Y, Z

ROUNDING_M = 1e-9
_BARELY_M = 1e-3  # parts that lie on each other are in each other by less
_FLAT, _PARALLEL = sin(radians(5.0)), cos(radians(5.0))
# What is turned by less than 5 degrees lies on the pads with its whole face, or line.

Span = tuple[float, float]


class Grasp(NamedTuple):
    """Where the TCP has been when the jaws closed on a part, and how that moved."""

    tcp: Transform
    before: Transform
    """Pose of the part in the tick before."""
    velocity: Vector
    """Velocity of the part (m/s), in the base."""


class Between(NamedTuple):
    """A part between the pads, as far as they are not too close together for it already."""

    name: str
    in_tcp: Transform
    """Pose of the part in the TCP."""
    width_m: float
    """Along y of the TCP."""
    across_m: float
    """Half of what it is along x."""
    along_m: float
    """Half of what it is along z."""
    radius_m: float
    """How round it is, seen along z: that of a ball or a cylinder along z, else 0."""

    @property
    def outermost_m(self) -> float:
        """How far apart the jaws are when the first of them meets it."""
        return 2.0 * abs(self.in_tcp.translation[Y]) + self.width_m


class Room(NamedTuple):
    """What room a part and those beside it, in a row along y of the TCP, take between the jaws."""

    below_m: float
    """From the jaw at lesser y to the middle of the part."""
    above_m: float
    """From there to the other jaw."""

    @property
    def all_m(self) -> float:
        """How far apart the jaws are at least."""
        return self.below_m + self.above_m

    def way(self, y: float, opening_m: float) -> float:
        """How far (m) jaws that are so far apart push it along y from there, by way of what is beside it."""
        half = 0.5 * opening_m
        up, down = self.below_m - half - y, y + self.above_m - half
        return up if up > 0.0 else -down if down > 0.0 else 0.0


def between_pads(parts: Iterable[tuple[Part, Transform]], tcp: Transform, gripper: Gripper) -> list[Between]:
    """Parts, given with their poses in the base, that are between the open jaws with the TCP there, and of
    which both pads would meet what is outermost along y."""
    seen, found = inverse(tcp), []
    (_, _, _, r3, r4, r5, _, _, _), (_, ty, _) = seen
    for part, pose in parts:
        x, y, z = pose.translation
        if 2.0 * abs(r3 * x + r4 * y + r5 * z + ty) > gripper.jaws.stroke_m + ROUNDING_M or (
            dist(pose.translation, tcp.translation) > part.shape.extent + gripper.reach_m
        ):
            continue
        in_tcp = compose(seen, pose)
        if on_pads(part, in_tcp, gripper.jaws):
            found.append(_between(part, in_tcp))
    return found


def _between(part: Part, in_tcp: Transform) -> Between:
    turned, shape = in_tcp.rotation, part.shape
    is_round = isinstance(shape, Sphere) or (isinstance(shape, Cylinder) and abs(turned[8]) >= _PARALLEL)
    across, along = part.reach(turned, X), part.reach(turned, Z)
    return Between(part.name, in_tcp, grip_width(part, in_tcp), across, along, across if is_round else 0.0)


def room_of(between: Sequence[Between]) -> dict[str, Room]:
    """What each part between the pads takes, by its name."""
    if len(between) == 1:
        half_m = 0.5 * between[0].width_m
        return {between[0].name: Room(half_m, half_m)}
    ordered = sorted(between, key=_place)
    below, above = _stacked(ordered), _stacked(ordered[::-1])
    return {each.name: Room(below[each.name], above[each.name]) for each in between}


def _place(each: Between) -> tuple[float, str]:
    return each.in_tcp.translation[Y], each.name


def _stacked(ordered: Sequence[Between]) -> dict[str, float]:
    """By name: the room (m) between the middle of each and the jaw that the first one faces."""
    found: dict[str, float] = {}
    for number, each in enumerate(ordered):
        before = (found[other.name] + _apart(other, each) for other in ordered[:number])
        found[each.name] = max(before, default=0.0)
        found[each.name] = max(found[each.name], 0.5 * each.width_m)
    return found


def _apart(one: Between, other: Between) -> float:
    """How far (m) the middles are apart along y where one that is pushed along that touches the other; far
    less than nothing where it passes it."""
    (x, _, z), (u, _, w) = one.in_tcp.translation, other.in_tcp.translation
    beside = abs(x - u) - (one.across_m + other.across_m)
    if beside >= -_BARELY_M or abs(z - w) >= one.along_m + other.along_m - _BARELY_M:
        return -inf
    radius = one.radius_m + other.radius_m
    flat = 0.5 * (one.width_m + other.width_m) - radius
    past = max(0.0, beside + radius)  # the middle of what is round, beside what of the other is flat
    return flat + sqrt(radius * radius - past * past)


def grip_width(part: Part, in_tcp: Transform) -> float:
    """Width (m) of a part between the jaws, along y of the TCP."""
    return 2.0 * part.reach(in_tcp.rotation, Y)


def on_pads(part: Part, in_tcp: Transform, jaws: Jaws) -> bool:
    """Whether both pads meet a part that is at this pose in the TCP: what of it is outermost along y lies on
    them, on both sides."""
    across, along = patch(part, in_tcp)
    x, _, z = in_tcp.translation
    wide, long = 0.5 * jaws.pad_wide_m, jaws.pad_long_m
    return all(
        x + side * across[0] - across[1] <= wide
        and x + side * across[0] + across[1] >= -wide
        and z + side * along[0] - along[1] <= 0.0
        and z + side * along[0] + along[1] >= -long
        for side in (-1.0, 1.0)
    )


def patch(part: Part, in_tcp: Transform) -> tuple[Span, Span]:
    """Spans along x and z of what is outermost of a part along y of the TCP: how far its middle is from the
    middle of the part, and half its size (m). On the other side it is that far the other way."""
    rotation, shape = in_tcp.rotation, part.shape
    spans = []
    for axis in (X, Z):
        middle = half = 0.0
        if isinstance(shape, Box):
            for k in range(3):
                on, out = rotation[3 * axis + k] * shape[k], rotation[3 * Y + k]
                if abs(out) <= _FLAT:
                    half += abs(on)
                else:
                    middle += on if out > 0.0 else -on
        elif isinstance(shape, Cylinder):
            on, out = rotation[3 * axis + 2], rotation[3 * Y + 2]
            if abs(out) <= _FLAT:
                half = abs(on) * shape.half_z
            else:
                middle = on * shape.half_z if out > 0.0 else -on * shape.half_z
            if abs(out) >= _PARALLEL:
                half += shape.radius
            else:  # the point of the rim, or of the mantle, that is farthest out
                middle -= shape.radius * on * out / sqrt(max(1e-12, 1.0 - out * out))
        spans.append((middle, half))
    return spans[0], spans[1]
