"""A part that is gripped where it lies on another one goes on touching that."""

from __future__ import annotations

import pytest

from iiwa_sim.contact.shapes import Box
from iiwa_sim.handling.part import Part
from tests.handling.scenes import TABLE_MM, Scene, at, down

LOW = Part("low", Box(0.02, 0.02, 0.015), 0.4, 0.5, 5e4)
GRASP_MM = TABLE_MM + 45.0


@pytest.mark.parametrize(("off_mm", "half_mm"), [(0.0, 20.0), (2.0, 20.0), (0.0, 19.0)])
def test_pressed_down_it_presses_the_one_below(off_mm: float, half_mm: float) -> None:
    """Corners at a side of what is below were pushed out by that side, and one went through the other."""
    upper = Part("upper", Box(1e-3 * half_mm, 0.02, 0.015), 0.4, 0.5, 5e4)
    scene = Scene((LOW, at(600.0, -100.0, TABLE_MM + 15.0)), (upper, at(600.0 + off_mm, -100.0, GRASP_MM)))
    scene.picks(600.0, -100.0, GRASP_MM)
    lay_m = scene.body("low").pose.translation[2]
    hangs_n = scene.controller.cartesian_force()[2]
    scene.goes(down(600.0, -100.0, GRASP_MM - 1.0), 0.02)
    assert scene.controller.cartesian_force()[2] < hangs_n - 4.0
    assert scene.body("low").pose.translation[2] < lay_m - 1e-4
