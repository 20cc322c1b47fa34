"""What went wrong: the last refusal, and the state of error that refuses moves until it is reset.

A refused command only leaves its record. What stops the robot by itself, an emergency stop, a servo timeout
or a fault of ours in a tick, is a state: it lasts until `reset`.
"""

from iiwa_sim.controller.errors import EMERGENCY_STOP, ErrorRecord, Refused

NO_CODE = 0


class Faults:
    """The errors of one controller, and what an emergency stop does to its drives."""

    def __init__(self) -> None:
        self.standing: ErrorRecord | None = None
        """The cause of the state of error; None where the robot is in none."""
        self.e_stopped = False
        """Whether the emergency stop is pressed."""
        self.drives_powered = True
        """Off from an emergency stop until it is reset."""
        self._refusal: ErrorRecord | None = None

    @property
    def last(self) -> ErrorRecord | None:
        """The cause of the state of error, else the last refusal since the last reset."""
        return self.standing or self._refusal

    def record(self, code: int, reason: str) -> None:
        """A command was refused."""
        self._refusal = ErrorRecord(code, reason)

    def fail(self, code: int, reason: str) -> None:
        """Something stops the robot: the state of error begins. In it the first cause is kept."""
        if self.standing is None:
            self.standing = ErrorRecord(code, reason)

    def press_emergency_stop(self) -> None:
        """It takes the place of any other cause: it has to be released before a reset."""
        self.e_stopped, self.drives_powered = True, False
        self.standing = ErrorRecord(EMERGENCY_STOP, "emergency stop")

    def release_emergency_stop(self) -> None:
        """The state of error lasts until it is reset."""
        self.e_stopped = False

    def check(self) -> None:
        """Raises `Refused` in the state of error."""
        if self.standing is not None:
            code, reason = self.standing
            raise Refused(code, f"no move before reset error: {reason}")

    def reset(self) -> None:
        """Ends the state of error and forgets the last refusal; raises `Refused` where its cause goes on."""
        if self.e_stopped:
            raise Refused(EMERGENCY_STOP, "the emergency stop has to be released first")
        self.standing = self._refusal = None
        self.drives_powered = True
