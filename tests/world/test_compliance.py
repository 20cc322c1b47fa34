"""A compliant robot that holds a part, rests on one, or is hit by one: it comes to rest, forces are right."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from iiwa_sim.frames import IDENTITY
from tests.requests import gravity_hold, lin_stiff_move
from tests.world.scenes import CLOSE, GRIPPER, HEAD, Scene, down, hold, part, table

STRONG = HEAD + GRIPPER.replace("grip_force_n = 40", "grip_force_n = 400")
Case = tuple[str, bool, float, float, float, float]
CASES: list[Case] = [
    (what, hold, stiffness, kg, own, below)
    for what, hold, stiffness, kg, own, below in product(
        ("held", "on", "hit"),
        (False, True),
        (100.0, 1000.0, 5000.0),
        (0.02, 0.2, 5.0),
        (5e3, 1e5, 1e6),
        (5e4, 1e6),
    )
    if (what == "held" or below == 5e4 or own == 1e6) and (what, kg, stiffness) != ("hit", 5.0, 100.0)
]


def settles(case: Case) -> tuple[float, float]:
    """Return the mean of the force (N) along z in the last 0.4 s of 2 s, and its range then."""
    what, hold, stiffness, kg, own, below = case
    parts = [part("block", (550, 0, 330), kg=kg, stiffness=own)]
    if what == "hit":
        parts.append(part("ball", (750, 400, 315), "[30, 30, 30]", kg, stiffness=own))
    scene = Scene(*parts, table(below), head=STRONG)
    scene.rests()
    k = 1.0 / (1.0 / own + 1.0 / below)
    down_mm = 1e3 * (0.01 if hold else min(15.0 / stiffness, 0.03))
    scene.goes(down(550, 0, 440), 1.0, straight=False)
    if what == "on":
        scene.drives(closed=True)
        z = 360.0
    else:
        scene.goes(down(550, 0, 335))
        scene.drives(closed=True)
        z = 335.0
        scene.goes(down(550, 0, 345 if what == "held" else 430))
    if what == "hit":
        z = 430.0
    elif hold:
        scene.goes(down(550, 0, z), 0.2)
        scene.goes(down(550, 0, z - 1e4 / k), 0.05)
    if hold:
        scene.controller.move(gravity_hold(stiffness))
        scene.step(100)
        scene.controller.load.wrench = (0.0, 0.0, 15.0, 0.0, 0.0, 0.0)
    else:
        target = down(550, 0, z if what == "hit" else z - down_mm)
        scene.controller.move(lin_stiff_move(target, 0.05, stiffness, (0.0,) * 6))
        scene.step(1500)
    if what == "hit":
        held, q = scene.world.pose(0).translation, scene.world.part_q[1]
        q[:3] = held[0], held[1] + 0.012, held[2] + 0.145
        scene.world.wake()
    forces = []
    for _ in range(1000):
        scene.step()
        forces.append(scene.arm.wrench[2])
    last = np.array(forces[-200:])
    return float(last.mean()), float(np.ptp(last))


def check(case: Case) -> None:
    mean, ripple = settles(case)
    assert ripple < 0.01 * max(abs(mean), 1.0), (case, mean, ripple)


def test_a_compliant_robot_comes_to_rest() -> None:
    check(CASES[133])


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_a_compliant_robot_comes_to_rest_in_all_cases(case: Case) -> None:
    check(case)


def test_a_compliant_robot_puts_down_its_part() -> None:
    scene = Scene(part("block", (500, 0, 330)), table())
    scene.picks(500, 0, 330, 60)
    scene.controller.move(lin_stiff_move(down(500, 0, 328), 0.3, 2000.0, (0.0,) * 6))
    scene.robot.runs_until_stopped()
    assert scene.part("block").state == "held"
    scene.controller.io.set_output(CLOSE, False)
    scene.step(500)
    assert scene.part("block").state == "lies"
    assert scene.controller.tool_frame().z_mm == pytest.approx(328.0, abs=0.01)


def test_a_hold_does_not_oscillate_with_the_arm_stretched() -> None:
    """A part in the jaws is pressed on a wall under the TCP."""
    head = STRONG.replace("[0, 30, 0, -60, 0, 90, 0]", "[0, 80, 0, -10, 0, 5, 0]")
    empty = Scene(part("block", (0, 600, -300), kg=0.2), head=head)
    tcp = empty.controller.tool_frame()
    x, y, z = tcp[:3]
    wall = f"""
[[plane]]
name = "wall"
x_mm = {x}
y_mm = {y}
z_mm = {z - 31.0}
stiffness_n_per_m = 100000
friction = 0.3
"""
    scene = Scene(part("block", (0, 600, z + 400.0), kg=0.2), wall, head=head)
    scene.controller.io.set_output(CLOSE, True)
    hold(scene.handling, IDENTITY)
    scene.controller.move(gravity_hold(1000.0))
    scene.step(100)
    r = np.array(scene.controller.tcp().rotation).reshape(3, 3)
    fx, fy, fz = (r.T @ (0.0, 0.0, -15.0)).tolist()
    scene.controller.load.wrench = (fx, fy, fz, 0.0, 0.0, 0.0)
    forces = []
    for _ in range(1000):
        scene.step()
        forces.append(scene.arm.wrench[:3])
    last = np.array(forces[-200:])
    assert np.ptp(last, axis=0).max() < 0.01 * np.abs(last).max()
