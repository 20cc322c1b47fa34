"""Why a command is refused. More codes, those of unreachable targets, are in `iiwa_sim.robot.nearest`."""

EXECUTION = 3000
"""The code of a refusal that has no code of its own."""
COMPONENT_NOT_READY = 3010
CROSSING_SINGULARITY = 3024


class Refused(Exception):
    """A command that is not carried out; nothing has changed.

    `code` is a result code of robot_movement_interface, `reason` one line of words.
    """

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(code, reason)
        self.code = code
        self.reason = reason
