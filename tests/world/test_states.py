"""Saved states: a restored one continues with the same bits; skipping ticks changes nothing."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from hashlib import sha256

import pytest

from iiwa_sim.cell.bodies import BoxSettings
from iiwa_sim.controller.carrying import ToolLoad
from tests.backdoor.bench import backdoor_of
from tests.requests import lin_move_at
from tests.world.scenes import CLOSE, Scene, down, part, table

CUBES = [
    part(f"{i} {k}", (500 + 22 * i, -60 + 22 * k, 310), "[20, 20, 20]", 0.02)
    for i in range(2)
    for k in range(4)
]


def ploughs(scene: Scene, ticks: int = 150) -> str:
    """Return a checksum of all states while the arm moves through cubes."""
    seen = sha256()
    scene.controller.move(lin_move_at(down(550, 100, 312), 0.25, 0.0))
    for _ in range(ticks):
        scene.step()
        seen.update(repr((scene.handling.parts, scene.force, scene.controller.joint_torque())).encode())
    return seen.hexdigest()


def before_cubes() -> Scene:
    scene = Scene(*CUBES, table())
    scene.drives(closed=True)
    scene.goes(down(550, -150, 420), 1.0, straight=False)
    scene.goes(down(550, -150, 312), 1.0)
    return scene


def halfway() -> Scene:
    """Return a scene in which the arm stands among cubes, some of which still move."""
    scene = before_cubes()
    scene.goes(down(550, -40, 312), 1.0)
    return scene


def holding() -> Scene:
    """Return a scene in which a held part is pressed on a lying one."""
    scene = Scene(part("upper", (550, -100, 330)), part("lower", (550, 100, 330)), table())
    scene.picks(550, -100, 330, 100)
    scene.goes(down(550, 100, 400))
    scene.goes(down(550, 100, 389.8))
    return scene


def carries(scene: Scene) -> str:
    seen = sha256()
    for frame, closed in (
        (down(550, 100, 450), True),
        (down(500, -200, 400), True),
        (down(500, -200, 420), False),
    ):
        scene.controller.io.set_output(CLOSE, closed)
        scene.controller.move(lin_move_at(frame, 0.4, 0.0))
        while scene.controller.moving:
            scene.step()
            seen.update(repr((scene.handling.parts, scene.force, scene.handling.state)).encode())
    return seen.hexdigest()


@pytest.mark.parametrize(("made", "goes"), [(halfway, ploughs), (holding, carries)])
def test_a_restored_state_continues_with_the_same_bits(
    made: Callable[[], Scene], goes: Callable[[Scene], str]
) -> None:
    scene = made()
    states = backdoor_of(scene.controller)
    states.save_state("here")
    first = goes(scene)
    scene.robot.runs_until_stopped()
    states.restore_state("here")
    assert goes(scene) == first
    scene.robot.runs_until_stopped()
    scene.rests()
    states.restore_state("here")
    assert goes(scene) == first


def test_a_robot_that_has_just_stopped_is_restored_with_the_weight_of_its_load_alone() -> None:
    scene = Scene(part("it", (550, 200, 330)), table())
    scene.controller.set_tool_load(ToolLoad(0.5, (0.0, 0.0, 0.05)))
    scene.goes(down(550, 0, 400))
    backdoor = backdoor_of(scene.controller)
    backdoor.save_state("here")
    scene.step(10)
    at_rest = scene.force
    backdoor.restore_state("here")
    scene.step()
    assert scene.force == at_rest


def test_surfaces_come_and_go_with_a_state() -> None:
    scene = Scene(part("it", (550, 0, 380)), table())
    backdoor = backdoor_of(scene.controller)
    scene.rests()
    backdoor.save_state("on the table")
    backdoor.remove_surface("table")
    size = (200.0, 200.0, 20.0)
    shelf = BoxSettings(name="shelf", size_mm=size, x_mm=550.0, z_mm=200.0, stiffness_n_per_m=1e5)
    backdoor.add_surface(shelf)
    scene.step(2)
    assert scene.part("it").state == "falls"
    assert scene.place_mm("it")[2] == pytest.approx(330.0, abs=0.3), "from where it was"
    scene.rests()
    assert scene.place_mm("it")[2] == pytest.approx(240.0, abs=0.3)
    backdoor.save_state("on the shelf")
    backdoor.restore_state("on the table")
    assert scene.place_mm("it")[2] == pytest.approx(330.0, abs=0.3)
    scene.step(200)
    assert scene.place_mm("it")[2] == pytest.approx(330.0, abs=0.3)
    backdoor.restore_state("on the shelf")
    scene.step(200)
    assert scene.place_mm("it")[2] == pytest.approx(240.0, abs=0.3)
    backdoor.restore_state("start")
    scene.step(2)
    assert scene.part("it").state == "falls"


@pytest.mark.slow
def test_two_processes_have_the_same_bits() -> None:
    code = "from tests.world.test_states import *; print(ploughs(halfway()))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert found.strip() == ploughs(halfway())
