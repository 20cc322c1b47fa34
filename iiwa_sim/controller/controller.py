"""The emulated controller, stepped: it takes commands between ticks and moves the robot in them."""

from collections.abc import Sequence

from iiwa_sim.controller.errors import (
    COMPONENT_NOT_READY,
    EMERGENCY_STOP,
    EXECUTION,
    STOP_TRIGGERED,
    ErrorRecord,
    Refused,
)
from iiwa_sim.controller.faults import DRIVES_OFF, PRESSED
from iiwa_sim.controller.modes import (
    SERVO_MODES,
    Mode,
)
from iiwa_sim.controller.moves import Moves
from iiwa_sim.frames import Transform
from iiwa_sim.motion.joints import Joints

LEAST_OVERRIDE = 1e-6
"""Other than 0: less is no motion that anybody could see, and no number to divide by."""


class Controller(Moves):
    """One robot, in one of the modes of `iiwa_sim.controller.modes`.

    Normal moves are checked when they are accepted and run one after the other; a smart or direct move takes
    the place of the one before. Commands either take effect at once and return, or raise `Refused` and change
    nothing; what has to wait until the robot rests, since the mode changes, is planned from where that will
    be. Frames are in the base, those of normal moves are of the TCP, of smart and direct moves of the flange.
    The same commands at the same ticks give the same motion.
    """

    def stop(self) -> None:
        """Bring the robot to rest on its path, and forget the moves that wait."""
        self._halt(STOP_TRIGGERED, "stopped")

    def cancel_move(self) -> None:
        """End the move that runs: stop on its path, and go on with the next one from where the robot then is.

        In a servo mode that is the move to the present target; the mode stays. Where nothing runs, or the
        robot is being stopped, nothing changes.
        """
        self._check_hold()
        with self.endings.because(STOP_TRIGGERED, "cancelled"):
            self._motions.cancel()

    def clear_queue(self) -> None:
        """Forget the moves that wait; the one that runs ends at its target.

        Where it has begun to blend into the next one, or is about to and too fast to rest at its target, the
        robot stops on its path.
        """
        with self.endings.because(STOP_TRIGGERED, "forgotten: the queue was cleared"):
            self._motions.clear()
        self._guards.keep(self.is_pending)

    def set_override(self, override: float) -> None:
        """Run all motions at this part of their planned speed, from 0, a pause, to 1.

        What moves stays on its path and keeps the planned limits; so it takes some time: 0.3 s, or what
        the slowest joint needs to stop; longer in servo modes and in impedance. At rest the override is there
        at once. Raises `Refused` for a number out of range.
        """
        if override != 0.0 and not LEAST_OVERRIDE <= override <= 1.0:
            raise Refused(EXECUTION, f"override {override:g}: expected 0, or {LEAST_OVERRIDE:g} to 1")
        self._motions.set_override(override)

    def reset_error(self) -> None:
        """End the state of error, and forget the last refusal.

        Raises `Refused` while the emergency stop is pressed.
        """
        self._faults.reset()

    def emergency_stop(self) -> None:
        """Stop as `stop` does, and take no moves until it is released and the error reset."""
        self._faults.press_emergency_stop()
        self._halt(EMERGENCY_STOP, PRESSED)
        self._tell(EMERGENCY_STOP, PRESSED)

    def release_emergency_stop(self) -> None:
        """The error remains, to be reset."""
        self._faults.release_emergency_stop()

    def switch_drives(self, on: bool) -> None:
        """Off: stop as `stop` does, and take no moves until they are on again and the error reset."""
        self._faults.switch_drives(on)
        if not on:
            self._halt(COMPONENT_NOT_READY, DRIVES_OFF)
            self._tell(COMPONENT_NOT_READY, DRIVES_OFF)

    def fail(self, code: int, reason: str) -> None:
        """Something goes wrong: stop as `stop` does, and take no moves until the error is reset."""
        self._faults.fail(code, reason)
        self._halt(code, reason)
        self._tell(code, reason)

    def refuse_next_move(self, refusal: ErrorRecord | None) -> None:
        """Refuse the next move outside of the state of error, whatever it asks for; None takes that back."""
        self._faults.refuse_next(refusal)

    def time_out_servo(self) -> None:
        """Stop as if a servo mode had heard of no command for too long; raises `Refused` in other modes."""
        if self.mode not in SERVO_MODES:
            modes = " or ".join(mode.value for mode in SERVO_MODES)
            raise Refused(EXECUTION, f"the mode is {self.mode.value}: expected {modes}")
        self._end_servo(f"no {self.mode.value} command in time: the robot stops")

    def place(self, joints: Sequence[float]) -> None:
        """Be at rest at joint positions (rad), without a way there, in no mode.

        Raises `Refused` outside the limits, and while anything moves or waits.
        """
        checked = self.check_place(joints)
        self._begin_anew(checked)
        self._joints_before = checked
        self.load.place(checked, self._tool_in_flange)

    def check_place(self, joints: Sequence[float]) -> Joints:
        """Raises `Refused` where `place` would; changes nothing."""
        self._check_rest()
        return self._planner.joint_target(joints, [1.0] * len(joints))

    def set_tool(self, tool_in_flange: Transform) -> None:
        """Take the TCP to be there from now on, in no mode; raises `Refused` while anything moves or waits.

        What waits was planned with the tool before.
        """
        self._check_rest()
        self._tool_in_flange = tool_in_flange
        self._begin_anew(self.joints)
        self.load.place(self.joints, tool_in_flange)

    def _begin_anew(self, joints: Joints) -> None:
        """Have motions that know of nothing before, at rest at joint positions (rad), in no mode."""
        override = self.override
        self.mode = Mode.UNKNOWN
        self._motions = self._motions_from(joints)
        self._motions.set_override(override)

    def _check_rest(self) -> None:
        if self.moving:
            raise Refused(EXECUTION, "the robot has to be at rest, with nothing waiting")
