"""Reasons for refusals and stops, and the error state that lasts until a reset.

Codes are robot_movement_interface's results. More of them, those of unreachable targets, are in
`iiwa_sim.robot.nearest`.
"""

import msgspec

SUCCESS = 0
EXECUTION = 3000
"""The code of a refusal that has no code of its own."""
COMPONENT_NOT_READY = 3010
TARGET_NOT_REACHABLE = 3020
CROSSING_SINGULARITY = 3024
EMERGENCY_STOP = 3030
COMMUNICATION_FAILURE = 3040
"""A line that cannot be read, or a client that sends nothing in time."""
STOP_TRIGGERED = 3060
"""An unrequested stop, and a move that was stopped, cancelled or replaced before its end."""

REPLACED = "replaced by a newer move, of a servo or in another mode"


class Refused(Exception):
    """A command that is not carried out; nothing has changed.

    `code` is a result code of robot_movement_interface, `reason` one line of words.
    """

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(code, reason)
        self.code = code
        self.reason = reason

    def __str__(self) -> str:
        return f"{self.code} {self.reason}"


class ErrorRecord(msgspec.Struct, frozen=True):
    """An error: a refusal, or a fault the robot met with on its own."""

    code: int
    reason: str


class RobotErrors:
    """The errors of one controller, and whether its drives are powered.

    A rejected command only leaves its record. A fault that stops the robot sets the error state, which
    lasts until `reset`.
    """

    def __init__(self) -> None:
        self.standing: ErrorRecord | None = None
        """The cause of the error state; None outside of it."""
        self.e_stopped = False
        """True if the emergency stop is pressed: no reset works before its release."""
        self.drives_powered = True
        """Off from an emergency stop, or from when they are switched off, until that is over and reset."""
        self.next_refusal: ErrorRecord | None = None
        """The refusal of the next move of any kind; None for none."""
        self.switched_off = False
        self._refusal: ErrorRecord | None = None

    @property
    def last(self) -> ErrorRecord | None:
        """The cause of the error state, else the last refusal since the last reset."""
        return self.standing or self._refusal

    def record(self, code: int, reason: str) -> None:
        """Record why a command was refused."""
        self._refusal = ErrorRecord(code, reason)

    def fail(self, code: int, reason: str) -> None:
        """Begin the error state; in it the first cause is kept, but for an emergency stop."""
        if self.standing is None or code == EMERGENCY_STOP:
            self.standing = ErrorRecord(code, reason)

    def check(self) -> None:
        """Raise `Refused` in the error state, or if the next move is to be refused."""
        if self.standing is not None:
            raise Refused(self.standing.code, f"no move before reset error: {self.standing.reason}")
        if self.next_refusal is not None:
            refusal, self.next_refusal = self.next_refusal, None
            raise Refused(refusal.code, refusal.reason)

    def reset(self) -> None:
        """End the error state and forget the last refusal; raise `Refused` while its cause lasts."""
        if self.e_stopped:
            raise Refused(EMERGENCY_STOP, "the emergency stop has to be released first")
        if self.switched_off:
            raise Refused(COMPONENT_NOT_READY, "the drives have to be switched on first")
        self.standing = self._refusal = None
        self.drives_powered = True
