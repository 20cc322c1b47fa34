"""Parts that move freely: they slide, rest on slopes, roll, tip, fall, ride on conveyors, are pushed."""

from __future__ import annotations

from itertools import product
from math import cos, hypot, radians, sin

import numpy as np
import pytest

from iiwa_sim.motion.impedance import STIFF
from iiwa_sim.world.gripper import CLOSES
from tests.requests import lin_move_at
from tests.world.scenes import CLOSE, TABLE_MM, G, Scene, down, part, table


def slope(deg: float, friction: float) -> str:
    """Return a box whose top goes down along x through the origin of the base, 1 m before it."""
    a = radians(deg)
    return f"""
[[box]]
name = "slope"
size_mm = [4000, 800, 40]
x_mm = {1000 - 20 * sin(a)}
z_mm = {-20 * cos(a)}
beta = {a}
stiffness_n_per_m = 100000
friction = {friction}
"""


def on_slope(deg: float, size: str, friction: float, kg: float = 0.3, stiffness: float = 1e5) -> Scene:
    """Return a part on the slope: a box 30 mm high, or a round part of 20 mm radius."""
    a, is_box = radians(deg), size.count(",") == 2
    high = 15.0 if is_box else 20.0
    place = (200.0, 0.0, 800.0 * sin(a) / cos(a) + high / cos(a))
    turned = f"beta = {a}\n" if is_box else "gamma = 1.5707963267948966\n"
    it = part("it", place, size, kg, friction, stiffness, turned)
    return Scene(slope(deg, friction), it)


@pytest.mark.parametrize(("kg", "stiffness"), [(0.02, 5e3), (0.2, 1e5), (2.0, 1e7)])
def test_a_part_slides_by_the_distance_of_coulombs_law(kg: float, stiffness: float) -> None:
    friction, speed, size = 0.3, 0.5, "[40, 40, 30]"
    scene = Scene(part("it", (400, -400, 315), size, kg, friction, stiffness), table(max(stiffness, 5e4)))
    scene.rests()
    start = scene.place_mm("it")
    scene.speeds[0, 1] = speed
    scene.world.wake()
    scene.until(lambda: scene.handling.settled or scene.place_mm("it")[2] > start[2] + 0.2)
    assert scene.handling.settled, "it is not lifted"
    distance = scene.place_mm("it")[1] - start[1]
    assert distance == pytest.approx(1e3 * speed**2 / (2.0 * friction * G), rel=0.03)


@pytest.mark.parametrize(("kg", "stiffness"), [(0.02, 1e5), (2.0, 5e3)])
def test_a_part_stays_on_a_slope_below_its_friction_angle(kg: float, stiffness: float) -> None:
    scene = on_slope(15.0, "[40, 40, 30]", 0.3, kg, stiffness)
    scene.step(500)
    start = scene.place_mm("it")
    scene.step(10_000)
    assert np.abs(scene.place_mm("it") - start).max() < 0.3


@pytest.mark.parametrize(("size", "inertia"), [("[20]", 0.4), ("[20, 60]", 0.5)])
def test_round_parts_roll_down_a_slope(size: str, inertia: float) -> None:
    scene = on_slope(10.0, size, 0.5)
    scene.step(100)
    before = np.linalg.norm(scene.speeds[0, :3])
    scene.step(250)
    rate = (np.linalg.norm(scene.speeds[0, :3]) - before) / 0.5
    assert rate == pytest.approx(G * sin(radians(10.0)) / (1.0 + inertia), rel=0.02)


@pytest.mark.parametrize(("high_mm", "tips"), [(20.0, False), (100.0, True)])
def test_a_block_that_is_pushed_above_its_middle_tips(high_mm: float, tips: bool) -> None:
    scene = Scene(part("it", (550, 0, 360), "[40, 40, 120]", 0.5, 0.5), table(friction=0.5))
    scene.drives(closed=True)
    z = TABLE_MM + high_mm
    scene.goes(down(550, -150, 460), straight=False)
    scene.goes(down(550, -150, z))
    scene.controller.move(lin_move_at(down(550, 10, z), 0.1, 0.0))
    scene.robot.runs_until_stopped()
    scene.rests()
    frame = scene.part("it").frame
    assert (abs(frame.gamma) > 1.0) == tips
    assert frame.z_mm == pytest.approx(320.0 if tips else 360.0, abs=1.0)


def test_a_tower_of_ten_falls_over() -> None:
    tower = [part(f"{k}", (550, 90, 315 + 30 * k), "[40, 40, 30]", 0.2) for k in range(10)]
    scene = Scene(*tower, table())
    scene.rests()
    assert scene.place_mm("9")[2] == pytest.approx(585.0, abs=3.0)
    scene.controller.io.set_output(CLOSE, True)
    scene.goes(down(500, -250, 560), 1.0, straight=False)
    scene.goes(down(550, -150, 560), 1.0)
    scene.controller.move(lin_move_at(down(550, 150, 560), 0.1, 0.0))
    scene.robot.runs_until_stopped()
    scene.rests()
    heights = [scene.place_mm(f"{k}")[2] for k in range(10)]
    assert max(heights) < 450.0
    assert all(each.state in ("lies", "gone") for each in scene.handling.parts)


def test_a_conveyor_carries_a_box_at_its_speed() -> None:
    belt = table(more="surface_velocity_mm_per_s = [0, 200, 0]")
    scene = Scene(part("it", (500, -500, 330)), belt)
    scene.step(150)
    start = scene.place_mm("it")
    scene.step(500)
    assert scene.place_mm("it")[1] - start[1] == pytest.approx(200.0, abs=0.01)
    assert scene.handling.under_way


def test_jaws_at_2500_mm_per_s_throw_no_cube_faster_than_10_m_per_s() -> None:
    """No move is so fast: the arm turns in its first joint alone."""
    cubes = product((515, 537, 559, 581), (-33, -11, 11, 33))
    scene = Scene(*(part(f"{x} {y}", (x, y, 310), "[20, 20, 20]", 0.02) for x, y in cubes), table())
    scene.rests()
    scene.drives(closed=True)
    scene.goes(down(490, -250, 420), straight=False)
    scene.goes(down(490, -250, 312))
    world, arm, joints = scene.world, scene.arm, scene.controller.joints
    fastest = 0.0
    for _ in range(100):
        joints = (joints[0] + 2.5 * 0.002 / hypot(0.49, 0.25), *joints[1:])
        arm.go(joints, arm.model.tcp(arm.setup.tool_in_flange).pose(joints), None, CLOSES, STIFF)
        world.step()
        fastest = max(fastest, float(np.linalg.norm(scene.speeds[:, :3], axis=1).max()))
    assert 2.5 < fastest < 10.0


@pytest.mark.parametrize("speed", [pytest.param(0.05, marks=pytest.mark.slow), 0.25])
def test_a_block_between_jaws_and_a_wall_presses_as_springs_in_series(speed: float) -> None:
    wall = table(name="wall", more="y_mm = 60\n").replace("[800, 1200, 40]", "[900, 20, 140]")
    scene = Scene(wall, part("it", (550, 0, 330), stiffness=5e4), table())
    scene.drives(closed=True)
    scene.goes(down(550, -150, 460), 1.0, straight=False)
    scene.goes(down(550, -150, 330))
    scene.controller.move(lin_move_at(down(550, 10, 330), speed, 0.0))
    most = 0.0
    while scene.controller.moving:
        scene.step()
        most = max(most, abs(scene.force[1]))
    too_far = 1e-3 * (10.0 + 8.0 + 40.0 - 50.0)
    springs = too_far / (1.0 / 25e3 + 1.0 / 5e4)
    assert most < 1.2 * springs
    assert abs(scene.force[1]) == pytest.approx(springs, rel=0.1)
    scene.goes(down(550, -150, 330))
    scene.rests()
    assert scene.place_mm("it") == pytest.approx((550.0, 30.0, 330.0), abs=1.0)
