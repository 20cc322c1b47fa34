"""What a robot works with, as it is drawn: its tool, the jaws of its gripper, parts, and where links touch
surfaces."""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from math import dist
from typing import NamedTuple

from iiwa_sim.contact.shapes import Box, Cylinder, Shape, Sphere
from iiwa_sim.controller.handling import GripperState, PartState
from iiwa_sim.controller.meetings import LinkTouch
from iiwa_sim.frames import IDENTITY, Frame, Transform, Vector, compose
from iiwa_sim.handling.falling import GONE, HELD
from iiwa_sim.handling.gripper import JAW_M
from iiwa_sim.robot.capsules import Capsule

LEAST_N = 1.0
"""The least force at the TCP (N) that is drawn as an arrow."""
M_PER_N, LONGEST_M = 0.005, 0.5
"""Length of the arrow of a force for each N, and at most: as on the live page."""

MOVED_MM = 1.0
"""A part that is no farther from where it was than this has not moved."""


class Rod(NamedTuple):
    """A cylinder along z with round ends, and its middle in the origin; a ball where it has no length."""

    radius: float
    """m"""
    half_z: float
    """Half the length (m) of the cylinder, without the ends."""


class Solid(NamedTuple):
    """A body in one place."""

    shape: Shape | Rod
    pose: Transform
    """Pose in the base (m)."""


class Things(NamedTuple):
    """What there is from a tick on, until something of it changes."""

    tick: int
    gripper: GripperState | None
    parts: tuple[PartState, ...]
    touches: tuple[LinkTouch, ...]


class ThingsOverTime:
    """All of that of one recording, and what the parts look like."""

    def __init__(
        self,
        shapes: Mapping[str, Shape] | None = None,
        jaw_m: Vector = JAW_M,
        tool: Sequence[Capsule] = (),
    ) -> None:
        """`shapes` are those of the parts, by their names; `jaw_m` is each jaw's size along x y z of the TCP,
        if there is a gripper; `tool` is what is fixed to the flange."""
        self.shapes = {} if shapes is None else shapes
        self._jaw_m = jaw_m
        self._tool = [Solid(Rod(each.radius_m, 0.5 * each.length_m), each.pose) for each in tool]
        self._changes: list[Things] = []

    def add(self, now: Things) -> None:
        """Note what there is at a tick, later than those before."""
        if not self._changes or now[1:] != self._changes[-1][1:]:
            self._changes.append(now)

    def at(self, tick: int) -> Things:
        """What there is at a tick."""
        place = bisect_right(self._changes, tick, key=lambda each: each.tick)
        return self._changes[place - 1] if place else Things(tick, None, (), ())

    @property
    def touches_mm(self) -> list[Vector]:
        """Where links have begun to touch surfaces, in the base."""
        found: list[Vector] = []
        before: set[tuple[str, str]] = set()
        for each in self._changes:
            found += [touch.point for touch in each.touches if (touch.link, touch.surface) not in before]
            before = {(touch.link, touch.surface) for touch in each.touches}
        return found

    def parts(self, tick: int) -> list[Solid]:
        """The parts at a tick."""
        return [solid for _, solid in self.named_parts(tick)]

    def named_parts(self, tick: int) -> list[tuple[str, Solid]]:
        """The parts at a tick, with their names."""
        return [
            (part.name, Solid(self.shapes[part.name], part.frame.to_transform()))
            for part in self.at(tick).parts
            if part.name in self.shapes and part.state != GONE
        ]

    def handled(self, first: int, last: int) -> set[str]:
        """The names of parts that are elsewhere at the last tick than at the first, or were held."""
        before = {part.name: part.frame for part in self.at(first).parts}
        found = {
            part.name
            for part in self.at(last).parts
            if part.name in before and dist(part.frame[:3], before[part.name][:3]) > MOVED_MM
        }
        return found | {part.name for each in self._changes for part in each.parts if part.state == HELD}

    def jaws(self, tick: int, tcp: Frame) -> list[Solid]:
        """The jaws of the gripper at a tick, with the TCP in this frame of the base."""
        gripper = self.at(tick).gripper
        if gripper is None:
            return []
        x, y, z = self._jaw_m
        away = 5e-4 * gripper.opening_mm + 0.5 * y
        places = [Transform(IDENTITY.rotation, (0.0, side * away, -0.5 * z)) for side in (1.0, -1.0)]
        return [Solid(Box(0.5 * x, 0.5 * y, 0.5 * z), compose(tcp.to_transform(), each)) for each in places]

    def tool(self, flange: Transform) -> list[Solid]:
        """What is fixed to the flange, with that at this pose in the base (m)."""
        return [Solid(each.shape, compose(flange, each.pose)) for each in self._tool]


def shapes_of(told: Sequence[Mapping[str, object]]) -> dict[str, Shape]:
    """The shapes of parts, by the names of these, as `DescribedCell.parts` tells them: raises ValueError for
    others."""
    return {str(part.get("name")): _shape(part) for part in told}


def _shape(part: Mapping[str, object]) -> Shape:
    match part:
        case {"shape": "box", "size_mm": [float() | int() as x, float() | int() as y, float() | int() as z]}:
            return Box(5e-4 * x, 5e-4 * y, 5e-4 * z)
        case {"shape": "sphere", "radius_mm": float() | int() as radius}:
            return Sphere(1e-3 * radius)
        case {"shape": "cylinder", "radius_mm": float() | int() as radius, "length_mm": float() | int() as z}:
            return Cylinder(1e-3 * radius, 5e-4 * z)
    raise ValueError(f"expected a part with a shape, not {part}")
