"""The common numbering of inputs and outputs in the ROS services.

Outputs come first, with the controller's numbers, so that set_io 1 is its output 1; inputs follow.
"""

from typing import NamedTuple

from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.io import NOT_AN_OUTPUT, NUMBER_OUT_OF_RANGE, Io

NO_SUCH_GROUP = 3
"""Error of get_digital_ios and set_digital_ios, besides those of `iiwa_sim.controller.io`."""
INPUT_GROUP, OUTPUT_GROUP = "DI", "DO"


class Pins(NamedTuple):
    """The inputs and outputs of a robot, each from number 1 on. Methods raise `Refused` for other numbers."""

    inputs: tuple[bool, ...]
    outputs: tuple[bool, ...]

    @classmethod
    def of(cls, io: Io) -> "Pins":
        """The present pins."""
        return cls(io.inputs, io.outputs)

    def numbered(self) -> tuple[list[tuple[int, bool]], list[tuple[int, bool]]]:
        """Numbers and states, of the inputs and of the outputs."""
        first = len(self.outputs) + 1
        return list(enumerate(self.inputs, first)), list(enumerate(self.outputs, 1))

    def get(self, number: int) -> bool:
        """The state of an input or output."""
        row = (*self.outputs, *self.inputs)
        if not 1 <= number <= len(row):
            there_are = f"there are outputs 1 to {len(self.outputs)}, inputs up to {len(row)}"
            raise Refused(NUMBER_OUT_OF_RANGE, f"no input or output {number}: {there_are}")
        return row[number - 1]

    def check_output(self, number: int) -> None:
        """Check that an output has this number."""
        self.get(number)
        if number > len(self.outputs):
            raise Refused(NOT_AN_OUTPUT, f"{number} is an input")

    def in_group(self, group: str, number: int) -> bool:
        """The state of a pin that is numbered in its group."""
        row = {INPUT_GROUP: self.inputs, OUTPUT_GROUP: self.outputs}.get(group)
        if row is None:
            raise Refused(NO_SUCH_GROUP, f"expected a group_id {INPUT_GROUP} or {OUTPUT_GROUP}")
        if not 1 <= number <= len(row):
            raise Refused(NUMBER_OUT_OF_RANGE, f"no pin {number} in {group}: there are 1 to {len(row)}")
        return row[number - 1]

    def check_switched(self, group: str, number: int) -> None:
        """Check that a pin can be switched, by its number in its group."""
        self.in_group(group, number)
        if group == INPUT_GROUP:
            raise Refused(NOT_AN_OUTPUT, f"{group} {number} is an input")
