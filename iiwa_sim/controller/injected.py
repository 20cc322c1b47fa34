"""What a test bench makes go wrong in the robot; no driver can."""

from iiwa_sim.controller.core import Core
from iiwa_sim.controller.errors import COMPONENT_NOT_READY, EXECUTION, ErrorRecord, Refused
from iiwa_sim.controller.faults import DRIVES_OFF
from iiwa_sim.controller.modes import SERVO_MODES


class Injected:
    """Faults of one robot. Each takes effect at once."""

    def __init__(self, core: Core) -> None:
        self._core = core

    def fail(self, code: int, reason: str) -> None:
        """Stop the robot as `Controller.stop` does, and take no moves until the error is reset."""
        self._core.faults.fail(code, reason)
        self._core.halt(code, reason)
        self._core.tell(code, reason)

    def switch_drives(self, on: bool) -> None:
        """Off: stop as `Controller.stop` does, and take no moves until they are on and the error reset."""
        self._core.faults.switch_drives(on)
        if not on:
            self._core.halt(COMPONENT_NOT_READY, DRIVES_OFF)
            self._core.tell(COMPONENT_NOT_READY, DRIVES_OFF)

    def refuse_next_move(self, refusal: ErrorRecord | None) -> None:
        """Refuse the next move outside of the state of error, whatever it asks for; None takes that back."""
        self._core.faults.refuse_next(refusal)

    def time_out_servo(self) -> None:
        """Stop as if a servo mode had received no command for too long; raises `Refused` in other modes."""
        mode = self._core.mode
        if mode not in SERVO_MODES:
            modes = " or ".join(mode.value for mode in SERVO_MODES)
            raise Refused(EXECUTION, f"the mode is {mode.value}: expected {modes}")
        self._core.end_servo(f"no {mode.value} command in time: the robot stops")
