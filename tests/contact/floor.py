"""Parts on a face, pushed tick by tick without a robot, and their energy."""

from __future__ import annotations

from types import ModuleType

from iiwa_sim.contact import crowd_kernel
from iiwa_sim.contact.crowd import LyingPart, PartMotion, PressingBall
from iiwa_sim.contact.crowd_kernel import Crowd
from iiwa_sim.contact.shapes import Box, Cylinder, Shape, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Frame, Transform
from iiwa_sim.handling.part import Part
from iiwa_sim.handling.pushed_kernel import gone_by

G = 9.81
TICK_S = 0.002
BELOW = 2e4
FRICTION = 0.5
REST = (0.0, 0.0, 0.0, 0.0)
CUBE = Box(0.02, 0.02, 0.02)
SHAPES: list[Shape] = [CUBE, Box(0.03, 0.005, 0.02), Cylinder(0.015, 0.02), Sphere(0.02)]


class Floor:
    """Parts on a face at height 0, pushed tick by tick."""

    def __init__(self, *walls: Surface, kernel: ModuleType = crowd_kernel) -> None:
        self.laid: list[LyingPart] = []
        self._walls = walls
        self._kernel = kernel

    def put(
        self, shape: Shape, x: float, y: float, angle: float = 0.0, velocity: tuple[float, ...] = REST
    ) -> None:
        half = shape.radius if isinstance(shape, Sphere) else shape.half_z  # type: ignore[union-attr]
        mass = 0.2
        z = half - mass * G / BELOW
        solid = Surface(
            "part",
            shape,
            Frame(1e3 * x, 1e3 * y, 1e3 * z, angle, 0.0, 0.0).to_transform(),
            5e4,
            0.0,
            FRICTION,
        )
        vx, vy, vz, spin = velocity
        self.laid.append(LyingPart(solid, (vx, vy, vz, spin), (), mass, -1, 0.0, BELOW, 0.0, 0.0))

    def begin(self) -> None:
        first = len(self.laid) + 1  # one is held elsewhere, to which the balls belong
        self.crowd: Crowd = self._kernel.Crowd(first, TICK_S)
        self.crowd.stand(self._walls, [first + number for number in range(len(self._walls))])
        for number, laid in enumerate(self.laid):
            self.crowd.lay(number, laid)

    def step(self, *balls: tuple[int, PressingBall], held: Surface | None = None) -> list[PartMotion]:
        self.crowd.hold(len(self.laid), held, 1.0)  # balls are brought from anywhere
        for number in range(len(self.laid)):
            self.crowd.look(number, [ball for part, ball in balls if part == number])
        found: list[PartMotion] = self.crowd.push(range(len(self.laid)))
        for gone in found:
            laid = self.laid[gone.part]
            solid = laid.solid._replace(pose=gone_by(laid.solid.pose, gone.way))
            laid = laid._replace(solid=solid, velocity=gone.velocity, wound=gone.wound)
            self.laid[gone.part] = laid
            self.crowd.lay(gone.part, laid)
        return found

    def energy(self) -> float:
        """Of motion, of height, and of all springs (J)."""
        total: float = self.crowd.stored_j
        for laid in self.laid:
            vx, vy, vz, spin = laid.velocity
            shape, pose = laid.solid.shape, laid.solid.pose
            half = shape.radius if isinstance(shape, Sphere) else shape.half_z  # type: ignore[union-attr]
            moments = Part("it", shape, laid.mass_kg, FRICTION, 5e4).moments(
                Transform(pose.rotation, (0.0, 0.0, 0.0))
            )
            total += 0.5 * laid.mass_kg * (vx * vx + vy * vy + vz * vz)
            total += 0.5 * (moments.xx + moments.yy) * spin * spin
            total += laid.mass_kg * G * pose.translation[2]
            total += 0.5 * BELOW * max(0.0, half - pose.translation[2]) ** 2
            total += 0.125 * BELOW * sum(each * each for each in laid.wound)
        return total
