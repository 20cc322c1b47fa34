"""What a test bench does to the robot: where it stands, its tool, and what goes wrong; no driver can."""

from collections.abc import Sequence

from iiwa_sim.controller.core import Core
from iiwa_sim.controller.error_state import DRIVES_OFF
from iiwa_sim.controller.errors import COMPONENT_NOT_READY, EXECUTION, ErrorRecord, Refused
from iiwa_sim.controller.modes import SERVO_MODES
from iiwa_sim.frames import Transform
from iiwa_sim.motion.joints import Joints


class Injected:
    """Deeds of a test bench on one robot. Each takes effect at once."""

    def __init__(self, core: Core) -> None:
        self._core = core

    def fail(self, code: int, reason: str) -> None:
        """Stop the robot as `Controller.stop` does, and take no moves until the error is reset."""
        self._core.fail(code, reason)

    def switch_drives(self, on: bool) -> None:
        """Off: stop as `Controller.stop` does, and take no moves until they are on and the error reset."""
        self._core.error_state.switch_drives(on)
        if not on:
            self._core.fail(COMPONENT_NOT_READY, DRIVES_OFF)

    def refuse_next_move(self, refusal: ErrorRecord | None) -> None:
        """Refuse the next move outside of the error state, whatever it asks for; None takes that back."""
        self._core.error_state.refuse_next(refusal)

    def time_out_servo(self) -> None:
        """Stop as if a servo mode had received no command for too long; raises `Refused` in other modes."""
        mode = self._core.mode
        if mode not in SERVO_MODES:
            modes = " or ".join(mode.value for mode in SERVO_MODES)
            raise Refused(EXECUTION, f"the mode is {mode.value}: expected {modes}")
        self._core.end_servo(f"no {mode.value} command in time: the robot stops")

    def place(self, joints: Sequence[float]) -> None:
        """Be at rest at joint positions (rad), without a way there, in no mode.

        Raises `Refused` outside the limits, and while anything moves or waits.
        """
        checked = self.check_place(joints)
        self._core.begin_anew(checked)
        self._core.joints_before = checked
        self._core.load.place(checked, self._core.tool_in_flange)
        self._take_along()

    def check_place(self, joints: Sequence[float]) -> Joints:
        """Raises `Refused` where `place` would; changes nothing."""
        self._check_rest()
        return self._core.planner.checked_joints(joints)

    def set_tool(self, tool_in_flange: Transform) -> None:
        """Take the TCP to be there from now on, in no mode; raises `Refused` while anything moves or waits.

        What waits was planned with the tool before.
        """
        self._check_rest()
        joints = self._core.motions.joints
        self._core.take_tool(tool_in_flange)
        self._core.begin_anew(joints)
        self._core.load.place(joints, tool_in_flange)
        self._take_along()

    def allow_what_is(self) -> None:
        """What is beyond a limit now may stay so, but not grow, as after the reset of a protective stop."""
        self._core.passed_limit(standing=True)

    def _take_along(self) -> None:
        """What the robot holds is where it is."""
        core = self._core
        if core.handling is not None:
            core.handling.tcp_is(core.motions.joints, core.load.tcp(core.motions.joints))

    def _check_rest(self) -> None:
        if self._core.motions.moving:
            raise Refused(EXECUTION, "the robot has to be at rest, with nothing waiting")
