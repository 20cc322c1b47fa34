"""Do gripping and letting go give anybody energy? Random scenes by a seed, on the parts of a cell alone.

`python -m tests.grip_hunting 0 10000` hunts. Jaws at rest close on a part that lies, stands or falls, hold
it, let it slide, open, and close again. The energy of height, of motion and of springs must at no time be
more than the least there has been.
"""

from __future__ import annotations

import sys

import numpy as np

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Frame, apply
from iiwa_sim.handling.falling import FALLS, LIES, STILL, Body
from iiwa_sim.handling.gripper import CLOSES, OPENS, Gripper, Jaws
from iiwa_sim.handling.part import Part
from iiwa_sim.handling.touching import points_of
from iiwa_sim.handling.workpieces import Workpieces
from tests.handling.scenes import DOWN, TABLE, TABLE_MM

G = 9.81
TICK_S = 0.002
ROUNDING_J = 1e-9
SHAPES = [
    Box(0.02, 0.02, 0.03),
    Box(0.04, 0.01, 0.02),
    Cylinder(0.015, 0.03),
    Cylinder(0.03, 0.01),
    Sphere(0.02),
]


def energy(pieces: Workpieces, surfaces: list[Surface]) -> float:
    """Of height, of motion, and of what is pressed into surfaces (J); friction only takes."""
    total = 0.0
    for body in pieces.bodies.values():
        part, pose = body.part, body.pose
        total += part.mass_kg * G * pose.translation[2]
        velocity = body.velocity if body.state in (LIES, FALLS) else pieces.kept().slip
        total += 0.5 * part.mass_kg * sum(v * v for v in velocity)
        if body.state == FALLS:
            continue
        points = points_of(part, upright=abs(pose.rotation[8]) >= 0.5**0.5)
        for surface in surfaces:
            soft = 1.0 / (1.0 / surface.stiffness + 1.0 / part.stiffness) / points.at_once
            for place in points.places:
                depth = points.radius_m - surface.nearest(*apply(pose, place))[0]
                total += 0.5 * soft * max(0.0, depth) ** 2
    return total


class GripScene:
    """One part, and jaws with the TCP at rest."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        shape = SHAPES[rng.integers(len(SHAPES))]
        mass, friction = float(rng.uniform(0.05, 2.0)), float(rng.uniform(0.0, 1.0))
        part = Part("it", shape, mass, friction, float(10.0 ** rng.uniform(4.3, 5.7)))
        above_mm = float(rng.uniform(0.0, 100.0)) * int(rng.integers(2))
        x, y, z = rng.uniform(-15.0, 15.0, 3).tolist()
        alpha = float(rng.uniform(-3.1, 3.1))
        height_mm = 1e3 * part.reach(Frame(0, 0, 0, alpha, 0, 0).to_transform().rotation, 2)
        middle = Frame(600.0, 0.0, TABLE_MM + height_mm + above_mm, alpha, 0.0, 0.0)
        self._tcp = Frame(600.0 + x, y, middle.z_mm + z, *DOWN).to_transform()
        self._gripper = Gripper(Jaws(0.1, 0.4, float(10.0 ** rng.uniform(-0.3, 2.0)), 0.03, 0.03))
        self._closes = int(rng.integers(1, 121))  # ticks of 200
        body = Body(part, middle.to_transform(), STILL, FALLS)
        self._pieces = Workpieces([body], [TABLE], self._gripper, TICK_S)

    def run(self) -> float:
        """The most that there has been more than before (J)."""
        pieces, gripper = self._pieces, self._gripper
        least, gained = energy(pieces, [TABLE]), 0.0
        for tick in range(600):
            driven = CLOSES if tick % 200 < self._closes or tick < 150 else OPENS
            was_m = gripper.opening_m
            gripper.step(driven, pieces.width_m, TICK_S)
            if driven == CLOSES and not pieces.held and gripper.opening_m < was_m:
                width_m = pieces.grip(self._tcp, was_m)
                if width_m > 0.0:
                    gripper.block(width_m)
            pieces.step(self._tcp)
            now = energy(pieces, [TABLE])
            gained, least = max(gained, now - least), min(least, now)
        return gained


def main() -> None:
    first, count = map(int, sys.argv[1:3])
    most = 0.0
    for seed in range(first, first + count):
        gained = GripScene(seed).run()
        if gained > ROUNDING_J:
            sys.stdout.write(f"{seed}: {gained:.1e} J\n")
            sys.stdout.flush()
        most = max(most, gained)
    sys.stdout.write(f"{count} scenes: {most:.1e} J\n")


if __name__ == "__main__":
    main()
