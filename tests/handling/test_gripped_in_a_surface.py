"""Jaws that close on a part into which a surface has been put do not kick it."""

from __future__ import annotations

from math import hypot

import pytest

from iiwa_sim.contact.shapes import Box, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import Transform
from iiwa_sim.handling.part import Part
from tests.handling.heaps import above
from tests.handling.scenes import BLOCK, CLOSE, PIN, TABLE, TABLE_MM, Scene, at, down

WALL = Surface("wall", Box(0.05, 0.05, 0.012), at(655.0, 0.0, 303.0), 1e5, 0.0, 0.3)
DOME = Surface("dome", Sphere(0.03), at(625.0, 0.0, 300.0), 1e5, 0.0, 0.3)
LIGHT = Part("light", Box(0.02, 0.02, 0.03), 0.05, 0.5, 1e5)


def gripped(part: Part, surface: Surface, pose: Transform) -> Scene:
    """The jaws have just closed on a part that stands with some of it in a surface."""
    scene = Scene((part, pose), surfaces=(TABLE, surface), cell=above())
    scene.goes(down(600.0, 0.0, TABLE_MM + 140.0))
    scene.goes(down(600.0, 0.0, TABLE_MM + 45.0))
    scene.controller.io.set_output(CLOSE, on=True)
    while not scene.handling.holds:
        scene.robot.step()
    return scene


@pytest.mark.parametrize("surface", [WALL, DOME])
@pytest.mark.parametrize("part", [BLOCK, PIN, LIGHT])
def test_what_it_is_in_does_not_press_it(part: Part, surface: Surface) -> None:
    """All corners that were in it pressed at once, as if they had just come in: with up to 0.6 J, and off it
    flew at 13 m/s."""
    scene = gripped(part, surface, at(600.0, 0.0, TABLE_MM + 30.0))
    before = scene.body(part.name).pose.translation
    for _ in range(200):
        scene.robot.step()
        kept = scene.handling.kept().parts
        assert hypot(*kept.slip) < 1e-9
    assert scene.handling.holds
    assert scene.body(part.name).pose.translation == pytest.approx(before, abs=1e-9)


def test_deeper_or_in_again_it_presses() -> None:
    """By how much deeper it is than it was, and as any other part when it has been out of it."""
    edge = WALL._replace(pose=at(667.0, 0.0, 303.0))  # it is in that by 3 mm
    scene = gripped(BLOCK, edge, at(600.0, 0.0, TABLE_MM + 30.0))
    assert pushed_back_n(scene, 600.3) > 5.0
    rubs_n = pushed_back_n(scene, 596.0)
    assert rubs_n == pytest.approx(-BLOCK.mass_kg * 9.81 * 0.5, abs=1.0), "on the table"
    assert pushed_back_n(scene, 597.3) > 5.0


def pushed_back_n(scene: Scene, x_mm: float) -> float:
    """How much it is pushed towards -x when it has been brought there."""
    scene.goes(down(x_mm, 0.0, TABLE_MM + 45.0), 0.02)
    scene.rests()
    return scene.controller.load.acting[0]  # x of the TCP looks that way
