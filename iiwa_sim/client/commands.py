"""The commands of the iiwa's line protocol, each as a method."""

import time
from collections.abc import Sequence

from iiwa_sim.client.connection import Connection
from iiwa_sim.client.replies import (
    CartesianForce,
    Frame,
    JointPosition,
    JointTorque,
    LastError,
    Reachability,
    RobotStatus,
)

_POLL_PERIOD_S = 0.01


class Iiwa(Connection):
    """A robot at the other end of a connection, one method per command."""

    def wait_until_stopped(self, timeout_s: float) -> None:
        """Returns when the robot is at rest; raises TimeoutError, and keeps the connection, if it is not."""
        deadline = time.monotonic() + timeout_s
        while self.get_status() != "stopped":
            if time.monotonic() > deadline:
                raise TimeoutError(f"the robot still moves after {timeout_s} s")
            time.sleep(_POLL_PERIOD_S)

    def hello(self) -> None:
        """The robot listens."""
        self._command("hello")

    def bye(self) -> None:
        """Stops the robot and ends the connection."""
        self._command("bye")
        self.close()

    def help(self, command: str = "") -> str:
        """All commands, or the usage of one."""
        return self._ask(f"help : {' '.join(command.split())}")

    def joint_move(self, joints: Sequence[float], speeds: Sequence[float]) -> None:
        """All joints together, straight in joint space; seven positions, seven speeds."""
        self._command("joint move", *joints, *speeds)

    def lin_move(self, target: Sequence[float], speed: float, blending: float) -> None:
        """The TCP on a straight line to a frame; blending in mm."""
        self._command("lin move", *target, speed, blending)

    def lin_joint_move(self, joints: Sequence[float], speed: float, blending: float) -> None:
        """The TCP on a straight line to where it is at joint positions; blending in mm."""
        self._command("lin joint move", *joints, speed, blending)

    def ptp_move(self, target: Sequence[float], speed: float, blending: float) -> None:
        """The TCP to a frame, straight in joint space; blending in mm."""
        self._command("ptp move", *target, speed, blending)

    def lin_quaternion_move(
        self, position: Sequence[float], quaternion: Sequence[float], speed: float, blending: float
    ) -> None:
        """As lin_move, to x y z (mm) with the orientation of a unit quaternion x y z w."""
        self._command("lin quaternion move", *position, *quaternion, speed, blending)

    def ptp_quaternion_move(
        self, position: Sequence[float], quaternion: Sequence[float], speed: float, blending: float
    ) -> None:
        """As ptp_move, to x y z (mm) with the orientation of a unit quaternion x y z w."""
        self._command("ptp quaternion move", *position, *quaternion, speed, blending)

    def lin_relative_move(self, shift: Sequence[float], speed: float, blending: float) -> None:
        """As lin_move, by x y z (mm) alpha beta gamma (rad) in base axes, from the end of the queue."""
        self._command("lin relative move", *shift, speed, blending)

    def lin_tool_relative_move(self, shift: Sequence[float], speed: float, blending: float) -> None:
        """As lin_relative_move, in the axes of the tool at the end of the queue."""
        self._command("lin tool relative move", *shift, speed, blending)

    def ptp_relative_move(self, shift: Sequence[float], speed: float, blending: float) -> None:
        """As lin_relative_move, straight in joint space."""
        self._command("ptp relative move", *shift, speed, blending)

    def ptp_tool_relative_move(self, shift: Sequence[float], speed: float, blending: float) -> None:
        """As lin_tool_relative_move, straight in joint space."""
        self._command("ptp tool relative move", *shift, speed, blending)

    def linr_move(self, target: Sequence[float], speed: float, blending: float, r: float) -> None:
        """As lin_move, with joint A3 at r (rad) at the target."""
        self._command("linr move", *target, speed, blending, r)

    def ptpr_move(self, target: Sequence[float], speed: float, blending: float, r: float) -> None:
        """As ptp_move, with joint A3 at r (rad) at the target."""
        self._command("ptpr move", *target, speed, blending, r)

    def linforcez_move(
        self, target: Sequence[float], speed: float, blending: float, thresholdZ: float
    ) -> None:
        """As lin_move, until the force along z has changed by the threshold (N)."""
        self._command("linforcez move", *target, speed, blending, thresholdZ)

    def ptpforcez_move(
        self, target: Sequence[float], speed: float, blending: float, thresholdZ: float
    ) -> None:
        """As ptp_move, until the force along z has changed by the threshold (N)."""
        self._command("ptpforcez move", *target, speed, blending, thresholdZ)

    def linforce_move(
        self,
        target: Sequence[float],
        speed: float,
        blending: float,
        thresholdX: float,
        thresholdY: float,
        thresholdZ: float,
    ) -> None:
        """As lin_move, until a force has changed by its threshold (N)."""
        self._command("linforce move", *target, speed, blending, thresholdX, thresholdY, thresholdZ)

    def ptpforce_move(
        self,
        target: Sequence[float],
        speed: float,
        blending: float,
        thresholdX: float,
        thresholdY: float,
        thresholdZ: float,
    ) -> None:
        """As ptp_move, until a force has changed by its threshold (N)."""
        self._command("ptpforce move", *target, speed, blending, thresholdX, thresholdY, thresholdZ)

    def linstiff_move(
        self, target: Sequence[float], speed: float, stiffness: float, force: Sequence[float]
    ) -> None:
        """As lin_move, pulled by a spring (N/m); `force` is what it shall balance: N, Nm, at the TCP."""
        self._command("linstiff move", *target, speed, stiffness, *force)

    def ptpstiff_move(
        self, target: Sequence[float], speed: float, stiffness: float, force: Sequence[float]
    ) -> None:
        """As ptp_move, pulled by a spring (N/m); `force` is what it shall balance: N, Nm, at the TCP."""
        self._command("ptpstiff move", *target, speed, stiffness, *force)

    def start_gravity(self, joint_stiffness: float) -> None:
        """Holds the joints by springs (Nm/rad) until stop."""
        self._command("start gravity", joint_stiffness)

    def smart_joint_move(self, joints: Sequence[float], speeds: Sequence[float]) -> None:
        """To a joint position from wherever the robot is now, in place of the smart move before."""
        self._command("smart joint move", *joints, *speeds)

    def smart_cartesian_move(self, target: Sequence[float], speed: float) -> None:
        """The flange to a frame from wherever the robot is now, in place of the smart move before."""
        self._command("smart cartesian move", *target, speed)

    def direct_joint_move(self, joints: Sequence[float], speeds: Sequence[float]) -> None:
        """To a joint position at most 0.087 rad from the present one on any axis."""
        self._command("direct joint move", *joints, *speeds)

    def direct_cartesian_move(self, target: Sequence[float], speed: float) -> None:
        """The flange to a frame that no axis is more than 0.087 rad from."""
        self._command("direct cartesian move", *target, speed)

    def stop(self) -> None:
        """Brings the robot to rest on its path and discards all waiting moves."""
        self._command("stop")

    def set_override(self, override: float) -> None:
        """Runs all motions at this part of their speed, 0 (a pause) to 1."""
        self._command("set override", override)

    def get_override(self) -> float:
        """The override that was set last."""
        return self._numbers("get override")[0]

    def cancel_move(self) -> None:
        """Ends the move that runs on its path; the robot goes on with the next one."""
        self._command("cancel move")

    def clear_queue(self) -> None:
        """Discards the moves that wait; the one that runs ends at its target."""
        self._command("clear queue")

    def get_queue(self) -> int:
        """How many moves wait behind the one that runs."""
        return int(self._numbers("get queue")[0])

    def get_status(self) -> str:
        """`moving`, also in a pause, or `stopped`."""
        return self._command("get status")

    def get_mode(self) -> str:
        """`unknown`, `normal`, `impedance`, `smart` or `direct`."""
        return self._command("get mode")

    def get_error(self) -> LastError:
        """What was refused, or has stopped the robot, last; code 0 and "none" if there was neither."""
        reply = self._text("get error")
        code, _, reason = reply.partition(" ")
        if not (code.isascii() and code.isdigit()):
            raise self._nonsense("get error", reply)
        return LastError(int(code), reason)

    def reset_error(self) -> None:
        """Ends the error that refuses moves, and forgets the last refusal."""
        self._command("reset error")

    def get_robot_status(self) -> RobotStatus:
        """The state of the robot as ROS-Industrial puts it."""
        return RobotStatus._make(map(int, self._numbers("get robot status")))

    def get_tool_frame(self) -> Frame:
        """The TCP in the base frame."""
        return Frame._make(self._numbers("get tool frame"))

    def get_flange_frame(self) -> Frame:
        """The flange, without tool, in the base frame."""
        return Frame._make(self._numbers("get flange frame"))

    def get_joint_position(self) -> JointPosition:
        """Positions of all joints."""
        return JointPosition._make(self._numbers("get joint position"))

    def get_joint_torque(self) -> JointTorque:
        """External torques on all joints."""
        return JointTorque._make(self._numbers("get joint torque"))

    def get_cartesian_force(self) -> CartesianForce:
        """Force and torque at the TCP."""
        return CartesianForce._make(self._numbers("get cartesian force"))

    def get_goal_frame(self) -> Frame:
        """The TCP at the end of the move under way, or where the robot holds."""
        return Frame._make(self._numbers("get goal frame"))

    def get_goal_joint_position(self) -> JointPosition:
        """Positions of all joints at the end of the move under way, or where the robot holds."""
        return JointPosition._make(self._numbers("get goal joint position"))

    def get_distance_to_goal(self) -> float:
        """How far the TCP is from the end of the move under way (mm)."""
        return self._numbers("get distance to goal")[0]

    def is_reachable(self, target: Sequence[float], r: float | None = None) -> Reachability:
        """Whether the TCP can be brought to a frame by PTP, with A3 at r (rad) if that is given."""
        return self._reachability("is reachable", target, r)

    def is_lin_reachable(self, target: Sequence[float], r: float | None = None) -> Reachability:
        """Whether it can go there on a straight line from the end of the queue."""
        return self._reachability("is lin reachable", target, r)

    def set_output(self, n: int, value: bool) -> None:
        """Switches a digital output, numbered from 1."""
        self._command("set output", n, value)

    def set_input(self, n: int, value: bool) -> None:
        """Always refused, with a code of its own: no driver sets an input."""
        self._command("set input", n, value)

    def get_output(self, n: int) -> bool:
        """The state of a digital output, numbered from 1."""
        return self._states("get output", n)[0]

    def get_input(self, n: int) -> bool:
        """The state of a digital input, numbered from 1."""
        return self._states("get input", n)[0]

    def get_outputs(self) -> tuple[bool, ...]:
        """The states of all digital outputs, from number 1 on."""
        return self._states("get outputs")

    def get_inputs(self) -> tuple[bool, ...]:
        """The states of all digital inputs, from number 1 on."""
        return self._states("get inputs")

    def _reachability(self, name: str, target: Sequence[float], r: float | None) -> Reachability:
        reply = self._text(name, *target, *([] if r is None else [r]))
        if reply == "reachable":
            return Reachability(True, 0, "")
        verdict, _, why = reply.partition(" ")
        code, _, reason = why.partition(" ")
        if verdict != "unreachable" or not (code.isascii() and code.isdigit()):
            raise self._nonsense(name, reply)
        return Reachability(False, int(code), reason)

    def _states(self, name: str, *values: float) -> tuple[bool, ...]:
        return tuple(number != 0.0 for number in self._numbers(name, *values))
