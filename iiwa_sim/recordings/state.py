"""The numbers of a recorded state, rounded: in full, what is found by arithmetic would be half of a file."""

from collections.abc import Sequence
from math import floor

from iiwa_sim.controller.state_lines import Numbers
from iiwa_sim.frames import Transform
from iiwa_sim.recordings.numbers_kernel import Numbers as RoundedNumbers
from iiwa_sim.robot.description import RobotDescription

PER_N = 1e4
"""Steps, of forces (N) and torques (Nm)."""


class Rounded(Numbers):
    """Those of the lines of a recording.

    Joint positions are not among them: they are the robot's own, bit for bit, so that a recording plays back
    to them.
    """

    def __init__(self, description: RobotDescription) -> None:
        super().__init__(description)
        self._rounded = RoundedNumbers(self._model.tcp_of_flange)

    def velocities(self, joints: Sequence[float], before: Sequence[float], tick_s: float) -> Sequence[float]:
        return self._rounded.velocities(joints, before, tick_s)

    def frames(
        self, joints: Sequence[float], tool_in_flange: Transform
    ) -> tuple[Sequence[float], Sequence[float]]:
        return self._rounded.frames(joints, tool_in_flange)

    def tcp(self, joints: Sequence[float], tool_in_flange: Transform) -> Sequence[float]:
        _, frame = self._rounded.frames(joints, tool_in_flange)
        return frame

    def forces(self, values: Sequence[float]) -> Sequence[float]:
        """To the nearest step."""
        return [floor(value * PER_N + 0.5) / PER_N for value in values]
