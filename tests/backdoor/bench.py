"""A stepped robot and its backdoor."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.cell.cell import robot_alone
from iiwa_sim.clock.clock import Clock
from iiwa_sim.clock.pace import STEPPED
from iiwa_sim.contact.shapes import Cylinder
from iiwa_sim.controller.handling import HandlingSetup, Wiring
from iiwa_sim.dialogue import Dialogue
from iiwa_sim.frames import IDENTITY, Frame
from iiwa_sim.protocols.faults import WireFaults
from iiwa_sim.world.gripper import Jaws
from iiwa_sim.world.part import Part
from tests.stepped import SteppedRobot
from tests.world.scenes import hold

IIWA, KR_6 = "lbr_iiwa_7_r800", "kr_6_r900_sixx"


DISC = Part("disc", Cylinder(0.02, 0.005), 0.2, 0.5, 1e5), Frame(0.0, 0.0, -5.0, 0.0, 0.0, 0.0).to_transform()
HANDLED = HandlingSetup(Jaws(0.08, 0.2, 40.0), Wiring(close_output=16, holds_input=16), (DISC,))


class OpenDoor:
    """An entrance that remembers."""

    def __init__(self) -> None:
        self.open = True

    def refuse(self) -> None:
        self.open = False

    def accept(self) -> None:
        self.open = True

    def drop_arriving(self, *, reset: bool) -> None:
        """Nobody arrives here."""


class Bench:
    """All of it."""

    def __init__(self, robot: str = IIWA) -> None:
        alone = robot_alone(robot)
        self.robot = SteppedRobot(cell=replace(alone, handled=HANDLED))
        self.controller = self.robot.controller
        self.wire, self.door, self.clock = WireFaults(), OpenDoor(), Clock(500, STEPPED)
        self.dialogue = Dialogue(lambda: self.controller.tick, self.controller.tick_s)
        self.backdoor = Backdoor(self.controller, self.wire, self._ports, self.clock, self.dialogue)

    def _ports(self) -> list[Any]:
        return [self.door]

    def grips_disc(self) -> None:
        """The disc is at the TCP, and held there."""
        handling = self.controller.handling
        assert handling is not None
        hold(handling, IDENTITY)
        self.controller.io.set_output(16, on=True)

    def seen(self) -> dict[str, object]:
        """All that can be changed from here."""
        backdoor, load = self.backdoor, self.controller.load
        return {
            "state": backdoor.state(),
            "surfaces": load.world.surfaces,
            "tool": backdoor.tool(),
            "push": (load.wrench, load.joint_push),
            "states": backdoor.states(),
            "faults": [(rule.fault, rule.connection, rule.left) for rule in self.wire._rules],
            "stuck": self.controller.handling is not None and self.controller.handling.gripper.stuck,
            "canned": {name: list(each) for name, each in self.wire.canned._replies.items()},
            "random": self.wire._random.getstate(),
            "door": self.door.open,
            "clock": backdoor.get_clock(),
            "next refusal": self.controller.errors.next_refusal,
        }
