"""Robots that share a world: they hand a part over, press on each other, share surfaces, and go alone."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

from iiwa_sim.cell.bodies import BoxSettings
from iiwa_sim.cell.cell import load_cells, shared_world
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.controller_group import ControllerGroup
from iiwa_sim.controller.endings import RobotEvent
from iiwa_sim.controller.errors import ErrorRecord
from iiwa_sim.frames import Frame
from iiwa_sim.world.world import World
from tests.backdoor.bench import backdoor_of
from tests.requests import lin_move, lin_move_at, ptp_move
from tests.world.scenes import CLOSE, DOWN, GRIPPER, HEAD, HOLDS, Scene, down, part, table

FACING = "x_mm = 1290\nalpha = 3.141592653589793"
LEVEL = (0.0, np.pi / 2, 0.0)
BAR = part("bar", (550, -200, 360), "[20, 30, 120]", 0.3)
H = 0.002
BACK = HEAD.replace("[0, 30, 0, -60, 0, 90, 0]", "[0, -30, 0, -110, 0, 80, 0]")


def robots(*bases: str) -> str:
    """Return the text of robots like that of `Scene`, each with its base."""
    keys = BACK.replace('\nrobot = "lbr_iiwa_7_r800"', "")
    keys += "gripper = {" + ", ".join(GRIPPER.strip().splitlines()[1:]) + "}"
    return "".join(f'[[robot]]\nname = "r{n}"\n{base}\n{keys}\n' for n, base in enumerate(bases))


class SharedWorld:
    """Stepped robots in one world."""

    def __init__(self, *texts: str, bases: tuple[str, ...] = ("", FACING)) -> None:
        with TemporaryDirectory() as folder:
            file = Path(folder) / "cell.toml"
            file.write_text(robots(*bases) + "".join(texts))
            cells = load_cells(file)
        self.world: World = shared_world(cells, H)
        self.faults: list[list[str]] = [[] for _ in cells]
        self.events: list[list[str]] = [[] for _ in cells]
        self.robots = [
            cell.controller(
                H,
                arm=arm,
                on_event=partial(self._on_event, n),
            )
            for n, (cell, arm) in enumerate(zip(cells, self.world.arms, strict=True))
        ]
        self.seen: list[Any] = []

    def _on_event(self, which: int, event: RobotEvent) -> None:
        if isinstance(event, str):
            self.events[which].append(event)
        elif isinstance(event, ErrorRecord):
            self.faults[which].append(event.reason)

    def step(self, ticks: int = 1) -> None:
        for _ in range(ticks):
            for robot in self.robots:
                robot.move_on()
            self.world.step()
            for robot in self.robots:
                robot.take_forces()
            self.seen.append([robot.cartesian_force() for robot in self.robots])

    def goes(self, which: int, frame: Frame, speed: float = 0.5, *, straight: bool = True) -> None:
        robot = self.robots[which]
        robot.move((lin_move if straight else ptp_move)(frame, speed, 0.0))
        while robot.moving:
            self.step()

    def drives(self, which: int, *, closed: bool, ticks: int = 300) -> None:
        self.robots[which].io.set_output(CLOSE, closed)
        self.step(ticks)

    def place_mm(self) -> np.ndarray[Any, Any]:
        """Return the position of the first part in the world."""
        return 1e3 * np.array(self.world.pose(0).translation)


def holding(off_mm: float = 0.0) -> SharedWorld:
    """Return a world in which the first robot holds a bar level, which the second one is about to take."""
    shared = SharedWorld(BAR, table())
    shared.goes(0, down(550, -200, 450), 1.0, straight=False)
    shared.goes(0, down(550, -200, 400))
    shared.drives(0, closed=True)
    shared.goes(0, down(550, 0, 500))
    shared.goes(1, Frame(680, off_mm, 455, *LEVEL), 1.0, straight=False)
    shared.goes(1, Frame(740, off_mm, 455, *LEVEL), 0.3)
    return shared


@pytest.mark.parametrize(("off_mm", "most_n"), [(0.0, 25.0), pytest.param(0.3, 75.0, marks=pytest.mark.slow)])
def test_a_part_is_handed_over_when_the_giver_opens(off_mm: float, most_n: float) -> None:
    shared = holding(off_mm)
    giver, taker = shared.world.arms
    assert giver.leads
    shared.seen.clear()
    shared.drives(1, closed=True)
    assert shared.robots[1].io.inputs[HOLDS - 1], "while the first one leads"
    assert giver.leads
    assert taker.held == 0
    assert not taker.leads
    forces = np.array(shared.seen)[..., :3]
    assert abs(forces).max() < most_n
    assert forces[-1, 0] == pytest.approx((0.0, forces[-1, 0, 1], 0.3 * 9.81), abs=0.05)
    before = shared.place_mm()
    shared.drives(0, closed=False, ticks=1)
    assert giver.held == -1
    assert taker.leads
    assert abs(shared.place_mm() - before).max() < 1e-3
    shared.step(200)
    assert shared.seen[-1][0][:3] == (0.0, 0.0, 0.0)
    assert np.linalg.norm(shared.seen[-1][1][:3]) == pytest.approx(0.3 * 9.81, abs=1e-3)
    shared.goes(0, down(550, 0, 600))
    shared.goes(1, Frame(680, off_mm, 455, *LEVEL))
    assert shared.place_mm() - before == pytest.approx((60.0, 0.0, 0.0), abs=1e-3)
    shared.drives(1, closed=False)
    assert shared.world.state(0) in ("falls", "lies")
    assert shared.place_mm()[2] < 400.0, "let go between both, it falls"


def test_a_taker_that_opens_again_or_draws_away_leaves_the_part_to_the_giver() -> None:
    shared = holding()
    shared.drives(1, closed=True)
    before = shared.place_mm()
    shared.drives(1, closed=False)
    assert shared.world.arms[0].leads
    assert not shared.robots[1].io.inputs[HOLDS - 1]
    assert shared.place_mm() == pytest.approx(before, abs=1e-6)
    shared.drives(1, closed=True)
    assert shared.world.arms[1].held == 0
    shared.goes(1, Frame(680, 0, 455, *LEVEL))
    assert shared.world.arms[1].held == -1
    assert shared.world.arms[0].leads
    before = shared.place_mm()
    shared.goes(0, down(550, 0, 560))
    assert shared.place_mm()[2] - before[2] == pytest.approx(60.0, abs=1e-3)


def closed_and_facing() -> SharedWorld:
    """Both with closed jaws; those of the second one are level, in the path of the first ones."""
    shared = SharedWorld(part("far", (300, 400, 330)), table())
    for which in (0, 1):
        shared.drives(which, closed=True)
    shared.goes(1, Frame(740, 0, 455, *LEVEL), 1.0, straight=False)
    shared.goes(0, down(500, 0, 430), 1.0, straight=False)
    return shared


def test_arms_press_on_each_other_with_5e4_n_per_m() -> None:
    shared = closed_and_facing()
    assert all(force == (0.0,) * 6 for force in shared.seen[-1])
    # Two jaws, 20 mm wide, go 3 mm into two others.
    shared.robots[0].move(lin_move_at(down(543, 0, 430), 0.1, 0.0))
    shared.step(1000)
    one, two = (np.array(force[:3]) for force in shared.seen[-1])
    assert np.linalg.norm(one) == pytest.approx(300.0, rel=0.02)
    assert abs(one[0]) == pytest.approx(abs(two[2]), rel=1e-6), "opposite, along their own tools"
    names = {name for each in shared.world.arms[0].contacts for name in (each.link, each.surface)}
    assert names == {"jaw 1", "jaw 2", "jaw 1 of robot 'r1'", "jaw 2 of robot 'r1'"}


@pytest.mark.slow
def test_links_touch_links() -> None:
    shared = SharedWorld(bases=("", "x_mm = 700\nalpha = 3.141592653589793"))
    for robot in shared.robots:
        robot.move(ptp_move(Frame(420, 0, 600, *DOWN), 1.0, 0.0))
    shared.step(3000)
    assert all(len(each) == 1 and "of robot" in each[0] for each in shared.faults), shared.faults
    assert any("link" in line for line in shared.events[0])


def works(robot: Controller, step: Any) -> list[Any]:
    """Forces and torques of a robot that picks a part up and presses it on the table."""
    seen = []

    def steps(ticks: int) -> None:
        for _ in range(ticks):
            step()
            seen.append((robot.cartesian_force(), robot.joint_torque()))

    for frame, close in (
        (down(550, -100, 420), False),
        (down(550, -100, 330), True),
        (down(550, 100, 331), True),
    ):
        for each in (frame._replace(z_mm=420.0), frame):
            robot.move(lin_move(each, 0.5, 0.0))
            while robot.moving:
                steps(1)
        robot.io.set_output(CLOSE, close)
        steps(200)
    robot.move(lin_move_at(down(550, 100, 329.5), 0.01, 0.0))
    steps(500)
    return seen


def test_a_robot_that_touches_no_other_has_the_same_forces_as_alone() -> None:
    block = part("block", (550, -100, 330))
    alone = Scene(block, table(), head=BACK + GRIPPER)
    expected = works(alone.controller, alone.controller.step)
    shared = SharedWorld(
        block, part("other", (1290 - 550, 300, 330)), table(), bases=("", "x_mm = 1900\nalpha = 3.14")
    )
    shared.robots[1].move(ptp_move(Frame(500, 300, 500, *DOWN), 0.2, 0.0))
    found = works(shared.robots[0], shared.step)
    assert len(found) == len(expected)
    for (force, torque), (other_force, other_torque) in zip(found, expected, strict=True):
        assert force == pytest.approx(other_force, abs=1e-6)
        assert torque == pytest.approx(other_torque, abs=1e-6)
    assert abs(expected[-1][0][2]) > 10.0
    assert not any(shared.faults)


def test_surfaces_are_those_of_all_robots() -> None:
    shared = SharedWorld(part("it", (550, 0, 500)), table())
    group = ControllerGroup(shared.robots)
    one, two = (backdoor_of(robot, group) for robot in shared.robots)
    size = (200.0, 200.0, 20.0)
    # In the base of the second robot, which faces the first: the shelf is under the part.
    two.add_surface(BoxSettings(name="shelf", size_mm=size, x_mm=740.0, z_mm=380.0, stiffness_n_per_m=1e5))
    shared.step(1000)
    assert shared.place_mm()[2] == pytest.approx(420.0, abs=0.2)
    one.move_surface("shelf", Frame(550, 0, 370, 0, 0, 0))
    shared.step(1000)
    assert shared.place_mm()[2] == pytest.approx(410.0, abs=0.2)
    two.remove_surface("shelf")
    shared.step(1000)
    assert shared.place_mm()[2] == pytest.approx(330.0, abs=0.2)
    assert all(robot.resting for robot in shared.robots)


def test_ten_robots_share_a_world() -> None:
    bases = tuple(f"x_mm = {3000 * (n % 2)}\ny_mm = {1500 * (n // 2)}" for n in range(10))
    shared = SharedWorld(part("it", (550, 0, 330)), table(), bases=bases)
    for robot in shared.robots:
        robot.move(ptp_move(Frame(500, 150, 450, *DOWN), 1.0, 0.0))
    shared.step(200)
    places = {robot.tool_frame() for robot in shared.robots}
    assert len(places) == 1
    assert not any(shared.faults)
