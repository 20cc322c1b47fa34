"""A robot rests only when ticks change no part, also where its jaws press on one."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.errors import Refused
from iiwa_sim.handling.falling import Body
from iiwa_sim.handling.part import Part
from iiwa_sim.wrench import Wrench
from tests.handling.heaps import above
from tests.handling.scenes import BLOCK, TABLE, TABLE_MM, Scene, at, down
from tests.samples import some

SHAPES = (Box(0.02, 0.02, 0.02), Sphere(0.02), Cylinder(0.02, 0.02))
LONGEST_TICKS = 12_000
"""In which all that is pressed comes to rest: a ball that turns to and fro below a jaw takes longest."""
PRESSED = (355, 389, 107)
"""Seeds of scenes in which parts stood still for a tick, and then went on."""


def pressed(seed: int) -> Scene:
    """A jaw has been driven to a part that lies, and may press on it."""
    rng = np.random.default_rng(seed)
    stiffness, shape = float(10 ** rng.uniform(4, 5.5)), SHAPES[rng.integers(3)]
    part = Part("it", shape, float(rng.choice([0.1, 0.5])), float(rng.choice([0.3, 0.5, 1.0])), stiffness)
    scene = Scene((part, at(600, 40, TABLE_MM + 20)), cell=above())
    x, y, z = (float(rng.uniform(low, high)) for low, high in ((-20, 20), (-5, 60), (5, 38)))
    scene.goes(down(600 + x, -60, TABLE_MM + z + 40))
    scene.goes(down(600 + x, -60, TABLE_MM + z))
    with suppress(Refused):  # there may be no way
        scene.goes(down(600 + x, y, TABLE_MM + z), 0.1)
    return scene


def seen(scene: Scene) -> tuple[Body, Wrench]:
    return scene.body("it"), scene.controller.load.acting


def assert_rests(scene: Scene) -> None:
    """It comes to rest before long, and ticks then change nothing."""
    for _ in range(LONGEST_TICKS):
        if scene.controller.resting:
            break
        scene.robot.step()
    assert scene.controller.resting
    before = seen(scene)
    for _ in range(20):
        scene.robot.step()
        assert seen(scene) == before
        assert scene.controller.resting


@pytest.mark.parametrize("seed", PRESSED)
def test_what_a_jaw_presses_on_is_at_rest_when_the_robot_is(seed: int) -> None:
    assert_rests(pressed(seed))


@settings(max_examples=some(40), deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_what_any_jaw_presses_on_comes_to_rest(seed: int) -> None:
    assert_rests(pressed(seed))


def test_parts_that_nothing_touches_take_no_ticks_of_rest() -> None:
    scene = Scene((BLOCK, at(600, 0, TABLE_MM + 30)), cell=above())
    scene.rests()
    scene.goes(down(600, 200, TABLE_MM + 200))
    scene.robot.step()
    assert scene.controller.resting


def test_what_leans_on_a_wall_goes_on_when_that_is_taken_away() -> None:
    wall = Surface("wall", Box(0.1, 0.02, 0.1), at(600, 81, TABLE_MM + 100), 2e4, 0.0, 0.3)
    scene = Scene((BLOCK, at(600, 40, TABLE_MM + 30)), surfaces=(TABLE, wall), cell=above())
    scene.goes(down(600, -60, TABLE_MM + 30))
    tcp_y = 0.0
    while scene.controller.load.acting[1] > -20.0 and tcp_y < 40.0:
        tcp_y += 1.0
        scene.goes(down(600, -61 + tcp_y, TABLE_MM + 30), 0.1)
    scene.rests()
    before = scene.body("block").pose.translation[1]
    scene.controller.load.world.remove("wall")
    scene.rests()
    assert scene.body("block").pose.translation[1] > before + 1e-4


def test_what_is_held_on_another_part_comes_to_rest() -> None:
    tall = Box(0.01, 0.02, 0.03)
    low, high = (Part(name, tall, 0.05, 0.5, 5e4) for name in ("low", "it"))
    scene = Scene((low, at(600, 0, TABLE_MM + 30)), (high, at(600, 0, TABLE_MM + 120)))
    scene.closes()
    scene.rests()
    assert scene.handling.holds
    assert_rests(scene)
