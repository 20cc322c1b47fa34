"""A robot with a gripper above a table, and parts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from iiwa_sim.cell.cell import Cell, robot_alone
from iiwa_sim.contact.shapes import Box, Cylinder, Sphere
from iiwa_sim.contact.surface import Surface
from iiwa_sim.controller.handling import Handling, HandlingSetup, Wiring
from iiwa_sim.frames import Frame, Transform
from iiwa_sim.handling.falling import Body
from iiwa_sim.handling.gripper import Jaws
from iiwa_sim.handling.part import Part
from tests.asked import lin_move, ptp_move
from tests.stepped import SteppedRobot

JAWS = Jaws(stroke_m=0.08, speed_m_per_s=0.2, force_n=40.0)
CLOSE = 1
HOLDS = 3
WIRING = Wiring(CLOSE, open_input=1, closed_input=2, holds_input=HOLDS)
TABLE_MM = 300.0
MOST_TICKS = 20_000
DOWN = (3.14159265359, 0.0, 3.14159265359)
TABLE = Surface(
    "table", Box(0.4, 0.5, 0.02), Frame(600.0, 0.0, TABLE_MM - 20.0, 0, 0, 0).to_transform(), 2e4, 0.0, 0.3
)
BLOCK = Part("block", Box(0.02, 0.02, 0.03), 0.5, 0.5, 5e4)
PIN = Part("pin", Cylinder(0.015, 0.03), 0.3, 0.5, 5e4)
BALL = Part("ball", Sphere(0.02), 0.2, 0.5, 5e4)


def at(x_mm: float, y_mm: float, z_mm: float, alpha: float = 0.0) -> Transform:
    return Frame(x_mm, y_mm, z_mm, alpha, 0.0, 0.0).to_transform()


def down(x_mm: float, y_mm: float, z_mm: float) -> Frame:
    """The TCP there, pointing down."""
    return Frame(x_mm, y_mm, z_mm, *DOWN)


class Scene:
    """A stepped robot in such a cell; its contact sphere is a point."""

    def __init__(
        self,
        *parts: tuple[Part, Transform],
        jaws: Jaws = JAWS,
        surfaces: tuple[Surface, ...] = (TABLE,),
        cell: Cell | None = None,
    ) -> None:
        alone = robot_alone() if cell is None else cell
        tool = Frame(0.0, 0.0, 150.0, 0.0, 0.0, 0.0).to_transform()
        start = tuple(map(float, alone.start))
        handled = HandlingSetup(jaws, WIRING, parts)
        self.robot = SteppedRobot(
            cell=replace(alone, tool_in_flange=tool, surfaces=surfaces, handled=handled, start=start)
        )
        self.controller = self.robot.controller

    @property
    def handling(self) -> Handling:
        assert self.controller.handling is not None
        return self.controller.handling

    def body(self, name: str) -> Body:
        assert self.handling.workpieces is not None
        return self.handling.workpieces.bodies[name]

    def goes(self, frame: Frame, speed: float = 0.5, *, straight: bool = True) -> None:
        self.controller.move((lin_move if straight else ptp_move)(frame, speed, 0.0))
        self.robot.runs_until_stopped()

    def closes(self, *, closed: bool = True) -> None:
        """Until the jaws are where they stay."""
        self.controller.io.set_output(CLOSE, closed)
        self.robot.step(2)
        self._steps_until(lambda: self.handling.gripper.settled(-1 if closed else 1))

    def rests(self) -> None:
        """Until ticks change nothing."""
        self._steps_until(lambda: self.controller.resting)

    def _steps_until(self, holds: Callable[[], bool]) -> None:
        for _ in range(MOST_TICKS):
            if holds():
                return
            self.robot.step()
        raise AssertionError("it does not come to rest")

    def picks(self, x_mm: float, y_mm: float, z_mm: float) -> None:
        """Down to a part there, and the jaws closed."""
        self.goes(down(x_mm, y_mm, z_mm + 80.0), straight=False)
        self.goes(down(x_mm, y_mm, z_mm))
        self.closes()
