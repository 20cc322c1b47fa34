"""The contact sphere round the TCP between jaws: it feels no part that these are about to grip."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import pytest

from iiwa_sim.cell.cell import robot_alone
from iiwa_sim.contact.shapes import Box, Cylinder, Shape, Sphere
from iiwa_sim.frames import Frame
from iiwa_sim.handling.falling import HELD
from iiwa_sim.handling.part import Part
from tests.handling.scenes import BLOCK, CLOSE, TABLE, TABLE_MM, Scene, down

RADIUS_M = 0.005
FREE = (0.0,) * 6


def scene_with(part: Part, z_mm: float, beta: float = 0.0) -> Scene:
    """A robot with a contact sphere of 5 mm, and a part whose middle is `z_mm` above the table."""
    cell = replace(robot_alone(), contact_radius_m=RADIUS_M)
    pose = Frame(600.0, 100.0, TABLE_MM + z_mm, 0.0, beta, 0.0).to_transform()
    return Scene((part, pose), cell=cell)


@pytest.mark.parametrize(
    ("shape", "z_mm", "beta", "tcp_mm"),
    [
        (Box(0.015, 0.0005, 0.03), 30.0, 0.0, 12.0),
        (Box(0.015, 0.003, 0.03), 30.0, 0.0, 12.0),
        (Box(0.015, 0.0049, 0.03), 30.0, 0.0, 12.0),
        (Cylinder(0.004, 0.03), 30.0, 0.0, 12.0),
        (Cylinder(0.004, 0.03), 4.0, pi / 2, 2.5),
        (Sphere(0.004), 4.0, 0.0, 3.0),
    ],
)
def test_a_part_thinner_than_the_sphere_is_gripped_and_felt_by_its_weight_alone(
    shape: Shape, z_mm: float, beta: float, tcp_mm: float
) -> None:
    part = Part("thin", shape, 0.02, 0.5, 5e4)
    scene = scene_with(part, z_mm, beta)
    scene.goes(down(600, 100, TABLE_MM + 92.0), straight=False)
    scene.goes(down(600, 100, TABLE_MM + 12.0))
    scene.goes(down(600, 100, TABLE_MM + tcp_mm), 0.05)
    pressed = [scene.controller.cartesian_force()]
    scene.controller.io.set_output(CLOSE, on=True)
    for _ in range(300):
        scene.robot.step()
        pressed.append(scene.controller.cartesian_force())
    assert scene.body("thin").state == HELD
    assert max(abs(force) for wrench in pressed for force in wrench[:2]) < 1.0
    scene.goes(down(600, 100, TABLE_MM + 92.0))
    scene.robot.step(2)  # until the end of the move is no longer felt
    assert scene.controller.cartesian_force()[2] == pytest.approx(0.02 * 9.81, rel=1e-3)
    scene.closes(closed=False)
    scene.rests()
    assert scene.body("thin").pose.translation[:2] == pytest.approx((0.6, 0.1), abs=1e-3)


def test_jaws_that_close_above_a_part_feel_it_when_the_sphere_comes_to_it_again() -> None:
    scene = scene_with(BLOCK, 30.0)
    top_mm = TABLE_MM + 60.0
    scene.goes(down(600, 100, top_mm + 80.0), straight=False)
    scene.goes(down(600, 100, top_mm + 2.0))
    scene.closes()
    scene.rests()
    assert scene.controller.cartesian_force() == FREE, "the sphere is 3 mm in the part, and did not come in"
    scene.goes(down(600, 100, top_mm + 10.0))
    scene.goes(down(600, 100, top_mm + 3.0), 0.02)
    below = 1.0 / (1.0 / TABLE.stiffness + 1.0 / BLOCK.stiffness)
    deep_m = 0.002 - BLOCK.mass_kg * 9.81 / below
    pressed_n = deep_m / (1.0 / below + 1.0 / BLOCK.stiffness)
    assert -scene.controller.cartesian_force()[2] == pytest.approx(pressed_n, rel=0.02)
