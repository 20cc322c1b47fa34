"""A stepped robot and its backdoor."""

from __future__ import annotations

from dataclasses import replace

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.cell.cell import robot_alone
from iiwa_sim.clock.clock import Clock
from iiwa_sim.clock.pace import STEPPED
from iiwa_sim.contact.shapes import Cylinder
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.controller_group import ControllerGroup
from iiwa_sim.controller.handling import HandlingSetup, Wiring
from iiwa_sim.dialogue import Dialogue
from iiwa_sim.frames import Frame
from iiwa_sim.protocols.faults import WireFaults
from iiwa_sim.world.gripper import Jaws
from iiwa_sim.world.part import Part
from tests.stepped import SteppedRobot

IIWA, KR_6 = "lbr_iiwa_7_r800", "kr_6_r900_sixx"


DISC = Part("disc", Cylinder(0.02, 0.005), 0.2, 0.5, 1e5), Frame(0.0, 0.0, -5.0, 0.0, 0.0, 0.0).to_transform()
HANDLED = HandlingSetup(Jaws(0.08, 0.2, 40.0), Wiring(close_output=16, holds_input=16), (DISC,))


def backdoor_of(controller: Controller, group: ControllerGroup | None = None) -> Backdoor:
    """Return the backdoor of a robot, which may share a cell."""
    return Backdoor(controller, WireFaults(), (), Clock(500, STEPPED), Dialogue(lambda: 0), group=group)


class Bench:
    """A stepped robot with gripper and parts, its dialogue and its backdoor."""

    def __init__(self, robot: str = IIWA) -> None:
        self.robot = SteppedRobot(cell=replace(robot_alone(robot), handled=HANDLED))
        self.controller = self.robot.controller
        self.dialogue = Dialogue(lambda: self.controller.tick * self.controller.tick_s)
        self.backdoor = Backdoor(self.controller, WireFaults(), (), Clock(500, STEPPED), self.dialogue)

    def seen(self) -> dict[str, object]:
        """Return the state that a rejected call must not change."""
        backdoor, load = self.backdoor, self.controller.load
        return {
            "state": backdoor.state(),
            "surfaces": load.contact.surfaces,
            "tool": self.controller.tool_in_flange,
            "push": (load.wrench, load.joint_push),
        }
