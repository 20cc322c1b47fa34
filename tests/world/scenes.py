"""Cells with parts as text, and a robot in simulated time that works in them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.cell.cell import load_cells
from iiwa_sim.controller.handling import Handling, PartState
from iiwa_sim.frames import Frame, Transform, compose
from iiwa_sim.world.arm import Arm
from iiwa_sim.world.build import wxyz
from iiwa_sim.world.gripper import CLOSES
from iiwa_sim.world.world import World
from tests.requests import lin_move, ptp_move
from tests.stepped import SteppedRobot

DOWN = (3.14159265359, 0.0, 3.14159265359)
CLOSE, HOLDS = 1, 3
TABLE_MM = 300.0
G = 9.81
MOST_TICKS = 20_000
HEAD = """
robot = "lbr_iiwa_7_r800"
start_deg = [0, 30, 0, -60, 0, 90, 0]
contact_radius_mm = 0
tool_in_flange = {x_mm = 0, y_mm = 0, z_mm = 150, alpha = 0, beta = 0, gamma = 0}
"""
GRIPPER = """
[gripper]
stroke_mm = 60
speed_mm_per_s = 120
grip_force_n = 40
close_output = 1
open_input = 1
closed_input = 2
holds_input = 3
"""


def table(stiffness: float = 5e4, friction: float = 0.3, more: str = "", name: str = "table") -> str:
    """Return a table whose top is at 300 mm."""
    return f"""
[[box]]
name = "{name}"
size_mm = [800, 1200, 40]
x_mm = 500
z_mm = 280
stiffness_n_per_m = {stiffness}
friction = {friction}
{more}"""


def part(
    name: str,
    place_mm: tuple[float, float, float],
    size: str = "[40, 40, 60]",
    kg: float = 0.5,
    friction: float = 0.5,
    stiffness: float = 1e5,
    more: str = "",
) -> str:
    """Return a box of a size in mm, a ball of a radius, or a cylinder of radius and length."""
    numbers = [float(each) for each in size.strip("[]").split(",")]
    shape, lengths = {
        1: ("sphere", "radius_mm = {}"),
        2: ("cylinder", "radius_mm = {}\nlength_mm = {}"),
        3: ("box", "size_mm = [{}, {}, {}]"),
    }[len(numbers)]
    x, y, z = place_mm
    return f"""
[[part]]
name = "{name}"
shape = "{shape}"
{lengths.format(*numbers)}
mass_kg = {kg}
friction = {friction}
stiffness_n_per_m = {stiffness}
x_mm = {x}
y_mm = {y}
z_mm = {z}
{more}"""


def down(x_mm: float, y_mm: float, z_mm: float) -> Frame:
    """Return the frame of the TCP there, pointing down."""
    return Frame(x_mm, y_mm, z_mm, *DOWN)


def hold(handling: Handling, in_tcp: Transform, opening_m: float = 0.04) -> None:
    """Have the jaws hold the first part at a pose in the TCP, wherever it was."""
    world, arm, gripper = handling.world, handling.arm, handling.gripper
    assert world is not None
    assert arm is not None
    assert gripper is not None
    world.catch_up(now=True)
    pose = compose(arm.tcp, in_tcp)
    world.part_q[0] = [*pose.translation, *wxyz(pose.rotation)]
    arm.tcp_before = arm.tcp
    gripper.opening_m, gripper.driven, gripper.blocked = opening_m, CLOSES, True
    arm.hold(0)
    world.wake()


class Scene:
    """A stepped robot in a cell."""

    def __init__(self, *texts: str, head: str = HEAD + GRIPPER, tick_s: float = 0.002) -> None:
        with TemporaryDirectory() as folder:
            file = Path(folder) / "cell.toml"
            file.write_text(head + "".join(texts))
            self.robot = SteppedRobot(cell=load_cells(file)[0], tick_s=tick_s)
        self.controller = self.robot.controller
        self.events: list[str] = []
        self.handling.arm.report = lambda line, _warns: self.events.append(line)

    @property
    def handling(self) -> Handling:
        assert self.controller.handling is not None
        return self.controller.handling

    @property
    def world(self) -> World:
        assert self.handling.world is not None
        return self.handling.world

    @property
    def arm(self) -> Arm:
        return self.world.arms[0]

    def part(self, name: str) -> PartState:
        return next(each for each in self.handling.parts if each.name == name)

    def place_mm(self, name: str) -> NDArray[np.float64]:
        return np.array(self.part(name).frame[:3])

    @property
    def speeds(self) -> NDArray[np.float64]:
        """Return velocities of all parts: m/s, and rad/s."""
        return self.world.part_v

    def step(self, ticks: int = 1) -> None:
        for _ in range(ticks):
            self.controller.step()

    def goes(self, frame: Frame, speed: float = 0.5, *, straight: bool = True) -> None:
        self.controller.move((lin_move if straight else ptp_move)(frame, speed, 0.0))
        self.robot.runs_until_stopped()

    def drives(self, *, closed: bool) -> None:
        """Step until the jaws rest."""
        self.controller.io.set_output(CLOSE, closed)
        self.step(2)
        self.rests()

    def rests(self) -> None:
        """Step until ticks change nothing."""
        self.until(lambda: self.handling.settled)

    def until(self, holds: Callable[[], bool]) -> int:
        """Step until a condition holds; return the ticks."""
        for tick in range(MOST_TICKS):
            if holds():
                return tick
            self.controller.step()
        raise AssertionError("it does not come to that")

    def picks(self, x_mm: float, y_mm: float, z_mm: float, up_mm: float = 80.0) -> None:
        """Down to a part there, the jaws closed, and up."""
        self.goes(down(x_mm, y_mm, z_mm + 80.0), straight=False)
        self.goes(down(x_mm, y_mm, z_mm))
        self.drives(closed=True)
        if up_mm:
            self.goes(down(x_mm, y_mm, z_mm + up_mm))

    @property
    def force(self) -> tuple[float, ...]:
        return self.controller.cartesian_force()
