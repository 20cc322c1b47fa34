"""Digital inputs and outputs: the controller switches outputs, the cell switches inputs.

They are numbered from 1, as KUKA numbers them ($OUT[1], $IN[1]): inputs and outputs each for themselves. The
codes of refusals are those of robot_movement_interface's services SetIO and GetIO.
"""

from collections.abc import Sequence

from iiwa_sim.controller.errors import Refused

NUMBER_OUT_OF_RANGE = 1
NOT_AN_OUTPUT = 2
DEFAULT_COUNT = 16
DEFAULT_INPUTS = tuple(f"input {number}" for number in range(1, DEFAULT_COUNT + 1))
DEFAULT_OUTPUTS = tuple(f"output {number}" for number in range(1, DEFAULT_COUNT + 1))


class Io:
    """The inputs and outputs of one controller, all off at first. Unknown numbers raise `Refused`."""

    def __init__(
        self,
        input_names: tuple[str, ...] = DEFAULT_INPUTS,
        output_names: tuple[str, ...] = DEFAULT_OUTPUTS,
    ) -> None:
        self.input_names = input_names
        self.output_names = output_names
        self.inputs = (False,) * len(self.input_names)
        """States of the inputs, from number 1 on. A change makes another tuple."""
        self.outputs = (False,) * len(self.output_names)
        """States of the outputs, as those of the inputs."""

    def input(self, number: int) -> bool:
        """Return the state of an input."""
        return self.inputs[_place("input", number, self.input_names)]

    def output(self, number: int) -> bool:
        """Return the state of an output."""
        return self.outputs[_place("output", number, self.output_names)]

    def set_output(self, number: int, on: bool) -> None:
        """Switch an output."""
        place = _place("output", number, self.output_names)
        self.outputs = (*self.outputs[:place], on, *self.outputs[place + 1 :])

    def wire(self, number: int, on: bool) -> None:
        """Switch an input from outside."""
        place = _place("input", number, self.input_names)
        self.inputs = (*self.inputs[:place], on, *self.inputs[place + 1 :])

    def refuse_input(self, number: int) -> None:
        """Reject a driver that sets an input: raise `Refused` for any number."""
        name = self.input_names[_place("input", number, self.input_names)]
        raise Refused(NOT_AN_OUTPUT, f"'{name}' is an input: what is wired to it sets it, no driver can")


def _place(kind: str, number: int, names: Sequence[str]) -> int:
    if not 1 <= number <= len(names):
        there_are = f"there are {kind}s 1 to {len(names)}" if names else f"there are no {kind}s"
        raise Refused(NUMBER_OUT_OF_RANGE, f"no {kind} {number:.16g}: {there_are}")
    return number - 1
