"""Which parts lie, on what, and what else stands there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Transform
from iiwa_sim.handling.falling import FALLS, LIES, STILL, Body, landed
from iiwa_sim.handling.ground import Ground, ground_of, grounds_of
from iiwa_sim.handling.part import Part

CLOSE_M = 1e-3
"""What is no farther above a face, or in it, at the beginning, lies on it."""


class Lying:
    """Parts among surfaces: what each lies on, and what it may touch."""

    def __init__(self, bodies: Iterable[Body], surfaces: Sequence[Surface]) -> None:
        """Parts where they are at the beginning, and what stands round them."""
        self._bodies = {each.part.name: each for each in bodies}
        self._surfaces = tuple(surfaces)
        self._solid: list[Surface] | None = None  # these, and parts that lie
        self._grounds: list[Ground] | None = None  # level faces of surfaces
        self.lying_changes = 0
        """How many times a part has come to lie, or has ceased to."""
        self.lying = [name for name, each in self._bodies.items() if each.state == LIES]
        """The names of the parts that lie."""

    @property
    def surfaces(self) -> Sequence[Surface]:
        """What stands there."""
        return self._surfaces

    def face_below(self, name: str) -> Ground | None:
        """The face on which a part lies."""
        on = self._bodies[name].on
        for face in self._level():
            if face.name == on:
                return face
        each = self._bodies.get(on)
        if each is None or each.state != LIES:
            return None
        return ground_of(on, each.part.shape, each.pose, each.part.stiffness)

    def flush_with(self, face: Ground, x: float, y: float) -> Ground | None:
        """Another face of a surface, as high as that, at a place (m, in the base)."""
        level = (each for each in self._level() if abs(each.top - face.top) <= CLOSE_M)
        return next((each for each in level if each.has(x, y)), None)

    def riders(self, name: str) -> Iterator[Body]:
        """What lies on a part, and on that."""
        for other in self.lying:
            if self._bodies[other].on == name:
                yield self._bodies[other]
                yield from self.riders(other)

    def _note_lying(self) -> None:
        """Other parts lie than before."""
        self.lying_changes += 1
        self.lying = [name for name, each in self._bodies.items() if each.state == LIES]

    def _level(self) -> list[Ground]:
        """The level faces of surfaces."""
        if self._grounds is None:
            self._grounds = grounds_of(self._surfaces)
        return self._grounds

    def _grounds_but(self, name: str) -> list[Ground]:
        found = list(self._level())
        for other, each in self._bodies.items():
            if other != name and each.state == LIES and each.velocity == STILL:
                ground = ground_of(other, each.part.shape, each.pose, each.part.stiffness)
                if ground is not None:
                    found.append(ground)
        return found

    def _all_solid(self) -> list[Surface]:
        """Surfaces, and parts that lie."""
        if self._solid is None:
            self._solid = list(self._surfaces)
            for name, each in self._bodies.items():
                if each.state == LIES:
                    part = each.part
                    self._solid.append(Surface(name, part.shape, each.pose, part.stiffness, 0.0, 0.0))
        return self._solid


def start(parts: Iterable[tuple[Part, Transform]], surfaces: Sequence[Surface]) -> list[Body]:
    """Parts as they are at the beginning: what stands right above a face lies on it, all else falls."""
    bodies: list[Body] = []
    for part, pose in sorted(parts, key=lambda each: each[1].translation[2]):
        body = Body(part, pose, STILL, FALLS)
        grounds = grounds_of(surfaces)
        for each in bodies:
            ground = ground_of(each.part.name, each.part.shape, each.pose, each.part.stiffness)
            if ground is not None and each.state == LIES:
                grounds.append(ground)
        x, y, z = pose.translation
        below = [each for each in grounds if each.top < z and each.has(x, y)]
        if below:
            top = max(below, key=lambda each: each.top)
            if abs(body.bottom - top.top) <= CLOSE_M:
                body = landed(body, top)
        bodies.append(body)
    return bodies
