"""What went wrong: the last refusal, and the error state that refuses moves until it is reset.

A refused command only leaves its record. What stops the robot by itself, an emergency stop, a servo timeout
or an internal error in a tick, is a state: it lasts until `reset`.
"""

from iiwa_sim.controller.errors import COMPONENT_NOT_READY, EMERGENCY_STOP, ErrorRecord, Refused

NO_CODE = 0
PRESSED = "emergency stop"
DRIVES_OFF = "the drives are off"


class RobotErrors:
    """The errors of one controller, and whether its drives are powered."""

    def __init__(self) -> None:
        self.standing: ErrorRecord | None = None
        """The cause of the error state; None where the robot is in none."""
        self.e_stopped = False
        """Whether the emergency stop is pressed."""
        self.drives_powered = True
        """Off from an emergency stop, or from when they are switched off, until that is over and reset."""
        self._switched_off = False
        self._refusal: ErrorRecord | None = None
        self.next_refusal: ErrorRecord | None = None
        """What the next move is refused with, whatever it asks for; None for nothing."""

    @property
    def last(self) -> ErrorRecord | None:
        """The cause of the error state, else the last refusal since the last reset."""
        return self.standing or self._refusal

    def record(self, code: int, reason: str) -> None:
        """A command was refused."""
        self._refusal = ErrorRecord(code, reason)

    def fail(self, code: int, reason: str) -> None:
        """Something stops the robot: the error state begins. In it the first cause is kept."""
        if self.standing is None:
            self.standing = ErrorRecord(code, reason)

    def press_emergency_stop(self) -> None:
        """Cut the drives off, in place of any other cause of error: no reset works before the release."""
        self.e_stopped, self.drives_powered = True, False
        self.standing = ErrorRecord(EMERGENCY_STOP, PRESSED)

    def release_emergency_stop(self) -> None:
        """Release the emergency stop; the error state lasts until it is reset."""
        self.e_stopped = False

    def switch_drives(self, on: bool) -> None:
        """Switch the drives: off, they are a cause of error, to be reset when they are on again."""
        self._switched_off = not on
        if not on:
            self.drives_powered = False
            self.fail(COMPONENT_NOT_READY, DRIVES_OFF)

    def refuse_next(self, refusal: ErrorRecord | None) -> None:
        """Have the next `check` fail that would not have failed anyway; None takes that back."""
        self.next_refusal = refusal

    def check(self) -> None:
        """Raises `Refused` in the error state, or if the next move is to be refused."""
        if self.standing is not None:
            code, reason = self.standing
            raise Refused(code, f"no move before reset error: {reason}")
        if self.next_refusal is not None:
            refusal, self.next_refusal = self.next_refusal, None
            raise Refused(*refusal)

    def reset(self) -> None:
        """Ends the error state and forgets the last refusal; raises `Refused` where its cause goes on."""
        if self.e_stopped:
            raise Refused(EMERGENCY_STOP, "the emergency stop has to be released first")
        if self._switched_off:
            raise Refused(COMPONENT_NOT_READY, "the drives have to be switched on first")
        self.standing = self._refusal = None
        self.drives_powered = True
