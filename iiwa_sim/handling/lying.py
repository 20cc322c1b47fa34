"""Which parts lie, on what, and what else stands there."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence

from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import IDENTITY, Transform, Vector
from iiwa_sim.handling.falling import FALLS, LEVEL_M, LIES, STILL, Body, has_no_room, landed
from iiwa_sim.handling.gripper import Gripper
from iiwa_sim.handling.ground import Ground, ground_of, grounds_of
from iiwa_sim.handling.part import Part
from iiwa_sim.handling.pieces_kernel import Pieces
from iiwa_sim.handling.piles_kernel import Piles
from iiwa_sim.handling.room import Outline, outline_of

CLOSE_M = 1e-3
"""What is no farther above a face, or in it, at the beginning, lies on it."""


class Lying(Pieces):
    """Parts among surfaces: what each lies on, and what it may touch."""

    def __init__(self, bodies: Iterable[Body], surfaces: Sequence[Surface], gripper: Gripper) -> None:
        """Parts where they are at the beginning, and what stands round them."""
        super().__init__(gripper)
        self._bodies = {each.part.name: each for each in bodies}
        self._surfaces = tuple(surfaces)
        self.put: set[str] = set()
        """Parts that are not as they were when the crowd was told last."""
        self._solid: list[Surface] | None = None  # these, and parts that lie
        self._solid_part: dict[str, Surface] = {}
        self._grounds: list[Ground] | None = None  # level faces of surfaces
        self._round: list[Outline] | None = None  # surfaces from above
        self._lie: list[Outline | None] = [None] * len(self._bodies)  # parts that lie from above, by number
        self._unseen: set[str] = set()  # those of which that may be another now
        self._bears: Counter[str] = Counter()  # how many parts lie right on each
        self._piles = Piles(self._bodies)
        self._note_all()

    @property
    def lying(self) -> list[str]:
        """The names of the parts that lie."""
        if self._lying is None:
            self._lying = [name for name, each in self._bodies.items() if each.state == LIES]
        return self._lying

    @property
    def piles(self) -> Piles:
        """Which parts lie on which."""
        self._piles.look(self._bodies, self.lying)
        return self._piles

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

    def riders(self, name: str) -> list[Body]:
        """What lies on a part, and on that."""
        if not self._bears[name]:
            return []
        piles = self.piles
        return [self._bodies[each] for each in piles.above(piles.numbers[name])]

    def is_below(self, name: str) -> bool:
        """Whether anything lies on a part."""
        return self._bears[name] > 0

    def _note_all(self) -> None:
        """All parts may be others than before."""
        self._unseen.update(self._bodies)
        self._bears = Counter(each.on for each in self._bodies.values() if each.state == LIES)
        self._note_lying()

    def _note_lying(self) -> None:
        """Other parts lie than before."""
        self.lying_changes += 1
        self._lying = None
        self._piles.change()

    def _put(self, body: Body) -> None:
        """A part is like that now."""
        name = body.part.name
        before, self._bodies[name] = self._bodies[name], body
        self.changes += 1
        self.put.add(name)
        self._unseen.add(name)
        if before.state == LIES:
            self._bears[before.on] -= 1
        if body.state == LIES:
            self._bears[body.on] += 1
        if (body.state == LIES) != (before.state == LIES):
            self._note_lying()
        elif body.on != before.on:
            self._piles.change()

    def _level(self) -> list[Ground]:
        """The level faces of surfaces."""
        if self._grounds is None:
            self._grounds = grounds_of(self._surfaces)
        return self._grounds

    def _beside(self, name: str) -> list[Outline]:
        """All that stands or lies, but for one part, from above."""
        if self._round is None:
            seen = (outline_of(each.name, each.shape, each.pose, each.stiffness) for each in self._surfaces)
            self._round = [each for each in seen if each is not None]
        numbers, lie = self._piles.numbers, self._lie
        for other in self._unseen:
            each, now = self._bodies[other], None
            if each.state == LIES:
                now = outline_of(other, each.part.shape, each.pose, each.part.stiffness)
            lie[numbers[other]] = None if now is None else now._replace(is_part=True)
        self._unseen.clear()
        number = numbers[name]
        return [*self._round, *filter(None, lie[:number]), *filter(None, lie[number + 1 :])]

    def _grounds_but(self, name: str, beside: Sequence[Outline] | None = None) -> list[Ground]:
        """The faces on which a part may lie: of surfaces, and of parts that lie."""
        parts = (each.face for each in (beside or self._beside(name)) if each.is_part)
        return [*self._level(), *(face for face in parts if face is not None)]

    def _shares(self, body: Body) -> tuple[Body, list[Body]]:
        """A part that has just landed, and all that moves of what it lies on, down to the surface.

        The uppermost of these and the part go on as fast as their momentum says, the others as theirs does
        with the part on them at rest.
        """
        slowed: list[Body] = []
        fast = body.velocity
        below = self._bodies.get(body.on)
        while below is not None and below.state == LIES:
            if not below.settled:
                slowed.append(self._slowed(below, body, fast))
                body, fast = body._replace(velocity=STILL), STILL
            below = self._bodies.get(below.on)
        return body, slowed

    def _slowed(self, below: Body, body: Body, fast: Vector) -> Body:
        """A part that moves, with another one on it from now on, which has come as fast (m/s) as that."""
        middle, carried = below.pose.translation, [below, *self.riders(below.part.name)]
        mass = sum(each.part.mass_kg for each in carried)
        about = sum(about_at(each, middle) for each in carried)
        share = mass / (mass + body.part.mass_kg)
        (x, y, z), (u, v, _) = below.velocity, fast
        slower = (share * x + (1.0 - share) * u, share * y + (1.0 - share) * v, share * z)
        return below._replace(velocity=slower, spin=below.spin * about / (about + about_at(body, middle)))

    def keeps(self, body: Body, face: Ground) -> bool:
        """Whether a part whose middle is beside a face lies on it for want of room."""
        return has_no_room(body, face.name, self._beside(body.part.name))

    def _all_solid(self) -> list[Surface]:
        """Surfaces, and parts that lie."""
        if self._solid is None:
            self._solid = list(self._surfaces)
            for name, each in self._bodies.items():
                if each.state == LIES:
                    part, solid = each.part, self._solid_part.get(name)
                    if solid is None or solid.pose is not each.pose:
                        solid = Surface(name, part.shape, each.pose, part.stiffness, 0.0, 0.0)
                        self._solid_part[name] = solid
                    self._solid.append(solid)
        return self._solid


def about_at(body: Body, place: Vector) -> float:
    """Moment of inertia (kg m^2) of a part about the vertical through a place (m)."""
    x, y, _ = (a - b for a, b in zip(body.pose.translation, place, strict=True))
    moments = body.part.moments(Transform(body.pose.rotation, IDENTITY.translation))
    return moments.xx + moments.yy + body.part.mass_kg * (x * x + y * y)


def taken_along(body: Body, before: Body, after: Body) -> Body:
    """What lies on another, which has gone straight on."""
    (x, y, z), start, end = body.pose.translation, before.pose.translation, after.pose.translation
    return body._replace(
        pose=body.pose._replace(translation=(x + end[0] - start[0], y + end[1] - start[1], z))
    )


def pressed_into(body: Body, faces: Iterable[Ground], from_above: Callable[[str], bool]) -> str:
    """The name of the level face into which a part, as it is let go of, is pressed from above, if any: where
    that is deep, the arm has felt it."""
    (x, y, _), bottom = body.pose.translation, body.bottom
    below = [each for each in faces if bottom < each.top and each.has(x, y)]
    found = [each for each in below if each.top - bottom <= LEVEL_M or from_above(each.name)]
    return max(found, key=lambda each: each.top).name if found else ""


def start(parts: Iterable[tuple[Part, Transform]], surfaces: Sequence[Surface]) -> list[Body]:
    """Parts as they are at the beginning: what stands right above a face lies on it, all else falls."""
    bodies: list[Body] = []
    grounds = grounds_of(surfaces)
    for part, pose in sorted(parts, key=lambda each: each[1].translation[2]):
        body = Body(part, pose, STILL, FALLS)
        x, y, z = pose.translation
        below = [each for each in grounds if each.top < z and each.has(x, y)]
        if below:
            top = max(below, key=lambda each: each.top)
            if abs(body.bottom - top.top) <= CLOSE_M:
                body = landed(body, top)
                ground = ground_of(part.name, part.shape, body.pose, part.stiffness)
                grounds += [] if ground is None else [ground]
        bodies.append(body)
    return bodies
