"""What the robot works with, wired to the controller's inputs and outputs."""

from typing import NamedTuple

import msgspec

from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.io import Io
from iiwa_sim.handling.gripper import CLOSES, OPENS, STAYS, Gripper, Jaws

SENSORS = ("open", "closed", "holds")
NOTHING = 0
"""Stands for the number of an input or an output where there is none."""


class Wiring(NamedTuple):
    """Numbers of outputs and inputs, from 1; `NOTHING` for what is not wired."""

    close_output: int
    """On closes. Off opens, where there is no other."""
    open_output: int = NOTHING
    """On opens; with both on, or both off, the jaws stay where they are."""
    open_input: int = NOTHING
    """On while the jaws are open to the stroke."""
    closed_input: int = NOTHING
    """On while jaw lies on jaw."""
    holds_input: int = NOTHING
    """On while they press on a part."""


class GripperState(msgspec.Struct, frozen=True):
    """A gripper in one tick."""

    opening_mm: float
    state: str
    """open, closed, holds, or between for neither of these"""


class Handling:
    """The gripper of one robot, in its ticks."""

    def __init__(self, jaws: Jaws, wiring: Wiring, io: Io, tick_s: float) -> None:
        self.gripper = Gripper(jaws)
        self._wiring = wiring
        self._io = io
        self._tick_s = tick_s
        self._wrong: dict[str, bool] = {}
        self._told: tuple[bool, ...] = ()
        self._tell()

    @property
    def settled(self) -> bool:
        """Whether ticks change nothing, as long as the robot stays where it is and outputs as they are."""
        return self.gripper.settled(self._driven())

    def step(self) -> None:
        """A tick."""
        if not self.settled:
            self.gripper.step(self._driven(), 0.0, self._tick_s)
            self._tell()

    @property
    def state(self) -> GripperState:
        """As it is, whatever its sensors tell."""
        gripper = self.gripper
        state = "holds" if gripper.holds else "open" if gripper.is_open else "between"
        return GripperState(1e3 * gripper.opening_m, "closed" if gripper.is_closed else state)

    def place(self, opening_m: float) -> None:
        """Have the jaws so far apart, at once."""
        self.gripper.opening_m = min(max(opening_m, 0.0), self.gripper.jaws.stroke_m)
        self.gripper.driven = self._driven()
        self._tell()

    def stick(self, stuck: bool) -> None:
        """A fault: the jaws stay where they are, until they are told not to."""
        self.gripper.stuck = stuck

    def mistake(self, sensor: str, tells: bool) -> None:
        """A fault: a sensor tells this, whatever is so. Raises `Refused` where there is no such sensor."""
        wired = [each for each in SENSORS if self._input(each) != NOTHING]
        if sensor not in wired:
            there_are = f"there are {', '.join(wired)}" if wired else "none is wired"
            raise Refused(EXECUTION, f"no sensor {sensor!r}: {there_are}")
        self._wrong[sensor] = tells
        self._tell()

    def repair(self) -> None:
        """End all faults of the gripper."""
        self.gripper.stuck = False
        self._wrong.clear()
        self._told = ()
        self._tell()

    def _input(self, sensor: str) -> int:
        number: int = getattr(self._wiring, f"{sensor}_input")
        return number

    def _driven(self) -> int:
        """Which way outputs drive the jaws."""
        closes = self._io.output(self._wiring.close_output)
        if self._wiring.open_output == NOTHING:
            return CLOSES if closes else OPENS
        opens = self._io.output(self._wiring.open_output)
        if opens == closes:
            return STAYS
        return OPENS if opens else CLOSES

    def _tell(self) -> None:
        """Switch the inputs, where that is news: a bench may have switched one otherwise."""
        gripper = self.gripper
        so = (gripper.is_open, gripper.is_closed, gripper.holds)
        told = tuple(self._wrong.get(sensor, is_so) for sensor, is_so in zip(SENSORS, so, strict=True))
        if told == self._told:
            return
        self._told = told
        for sensor, on in zip(SENSORS, told, strict=True):
            number = self._input(sensor)
            if number != NOTHING:
                self._io.wire(number, on)
