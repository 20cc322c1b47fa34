"""The common numbering of inputs and outputs in the ROS services.

Outputs come first, with the controller's numbers, so that set_io 1 is its output 1; inputs follow.
"""

from typing import NamedTuple

from iiwa_sim.controller.io import NOT_AN_OUTPUT, NUMBER_OUT_OF_RANGE
from iiwa_sim.ros.rmi.robot import Failure, State

NO_SUCH_GROUP = 3
SETTING_FAILED = 4
"""Error of get_digital_ios and set_digital_ios, besides those of `iiwa_sim.controller.io`."""
UNKNOWN = -1
"""Error of get_io and set_io for a robot that does not report inputs and outputs."""
INPUT_GROUP, OUTPUT_GROUP = "DI", "DO"


class Pins(NamedTuple):
    """The inputs and outputs of a robot, each from number 1 on."""

    inputs: tuple[bool, ...]
    outputs: tuple[bool, ...]

    @classmethod
    def of(cls, state: State | None) -> "Pins | Failure":
        """The pins of a robot, or why they are unknown."""
        if state is None or state.inputs is None or state.outputs is None:
            return Failure(UNKNOWN, "the robot tells nothing of its inputs and outputs")
        return cls(state.inputs, state.outputs)

    def numbered(self) -> tuple[list[tuple[int, bool]], list[tuple[int, bool]]]:
        """Numbers and states, of the inputs and of the outputs."""
        first = len(self.outputs) + 1
        return list(enumerate(self.inputs, first)), list(enumerate(self.outputs, 1))

    def get(self, number: int) -> bool | Failure:
        """The state of an input or output."""
        row = (*self.outputs, *self.inputs)
        return row[number - 1] if 1 <= number <= len(row) else self._no_such(number)

    def output(self, number: int) -> int | Failure:
        """The controller's number of an output, or why there is none."""
        if 1 <= number <= len(self.outputs):
            return number
        if 1 <= number <= len(self.outputs) + len(self.inputs):
            return Failure(NOT_AN_OUTPUT, f"{number} is an input")
        return self._no_such(number)

    def in_group(self, group: str, number: int) -> bool | Failure:
        """The state of a pin that is numbered in its group."""
        row = {INPUT_GROUP: self.inputs, OUTPUT_GROUP: self.outputs}.get(group)
        if row is None:
            return Failure(NO_SUCH_GROUP, f"expected a group_id {INPUT_GROUP} or {OUTPUT_GROUP}")
        if 1 <= number <= len(row):
            return row[number - 1]
        return Failure(NUMBER_OUT_OF_RANGE, f"no pin {number} in {group}: there are 1 to {len(row)}")

    def to_switch(self, group: str, number: int) -> Failure | None:
        """Why a pin cannot be switched, by its number in its group; None if it can."""
        state = self.in_group(group, number)
        if isinstance(state, Failure):
            return state
        return Failure(NOT_AN_OUTPUT, f"{group} {number} is an input") if group == INPUT_GROUP else None

    def _no_such(self, number: int) -> Failure:
        outputs, all_of_them = len(self.outputs), len(self.outputs) + len(self.inputs)
        there_are = f"there are outputs 1 to {outputs}, inputs {outputs + 1} to {all_of_them}"
        return Failure(NUMBER_OUT_OF_RANGE, f"no input or output {number}: {there_are}")
