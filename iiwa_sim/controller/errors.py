"""Why a command is refused, or the robot stops of itself. Codes are robot_movement_interface's results.

More of them, those of unreachable targets, are in `iiwa_sim.robot.nearest`.
"""

from typing import NamedTuple

SUCCESS = 0
EXECUTION = 3000
"""The code of a refusal that has no code of its own."""
COMPONENT_NOT_READY = 3010
TARGET_NOT_REACHABLE = 3020
CROSSING_SINGULARITY = 3024
EMERGENCY_STOP = 3030
COMMUNICATION_FAILURE = 3040
"""A line that makes no sense, or a client that is not heard of in time."""
STOP_TRIGGERED = 3060
"""A stop that nobody asked for, and a move that was stopped, cancelled or replaced before its end."""


class Refused(Exception):
    """A command that is not carried out; nothing has changed.

    `code` is a result code of robot_movement_interface, `reason` one line of words.
    """

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(code, reason)
        self.code = code
        self.reason = reason


class ErrorRecord(NamedTuple):
    """What went wrong last: a refusal, or a fault the robot met with on its own."""

    code: int
    reason: str
