"""The commands of the iiwa's line protocol, each as a method.

Written by `python -m tools.client_source` from protocol/iiwa.toml: not to be changed by hand.
"""

from collections.abc import Sequence

from iiwa_sim.client.blocking import Connection
from iiwa_sim.client.exchange import exactly
from iiwa_sim.client.lines import IIWA, phrase, request
from iiwa_sim.client.readers import (
    integer,
    integers,
    last_error,
    nothing,
    number,
    numbers,
    one_of,
    reachability,
    state,
    states,
    text,
)
from iiwa_sim.client.replies import (
    CartesianForce,
    CollisionThresholds,
    Frame,
    JointPosition,
    JointTorque,
    LastError,
    Reachability,
    RobotStatus,
    ToolLoad,
)


class Iiwa(Connection[str, str]):
    """A robot at the other end of a connection, one method per command."""

    _language = IIWA

    def hello(self) -> None:
        """Says hello back, and so shows that the controller listens."""
        self._do(request(nothing("hello"), "hello"))

    def bye(self) -> None:
        """Stops the robot and ends the connection."""
        self._do(request(nothing("bye"), "bye"))
        self.close()

    def help(self, command: str = "") -> str:
        """Names the commands, or tells the usage of the one given, the extensions, or what an error code
        means."""
        return self._do(phrase(text, "help", command))

    def joint_move(self, joints: Sequence[float], speeds: Sequence[float]) -> None:
        """Moves all joints together, straight in joint space, to a joint position.

        joints: j0 j1 j2 j3 j4 j5 j6 (rad)
        speeds: v0 v1 v2 v3 v4 v5 v6 (relative)
        """
        self._do(
            request(
                nothing("done"),
                "joint move",
                *exactly(7, "joints", joints),
                *exactly(7, "speeds", speeds),
            )
        )

    def lin_move(self, target: Sequence[float], speed: float, blending: float) -> None:
        """Moves the TCP on a straight line to a frame.

        target: x y z (mm) alpha beta gamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        blending: radius round the target in which the next move may take over (mm), 0 <= blending
        """
        self._do(request(nothing("done"), "lin move", *exactly(6, "target", target), speed, blending))

    def ptp_move(self, target: Sequence[float], speed: float, blending: float) -> None:
        """Moves the TCP to a frame, straight in joint space.

        target: x y z (mm) alpha beta gamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        blending: radius round the target in which the next move may take over (mm), 0 <= blending
        """
        self._do(request(nothing("done"), "ptp move", *exactly(6, "target", target), speed, blending))

    def lin_joint_move(self, joints: Sequence[float], speed: float, blending: float) -> None:
        """Moves the TCP on a straight line to where it is at a joint position.

        joints: j0 j1 j2 j3 j4 j5 j6 (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        blending: radius round the target in which the next move may take over (mm), 0 <= blending
        """
        self._do(request(nothing("done"), "lin joint move", *exactly(7, "joints", joints), speed, blending))

    def lin_quaternion_move(
        self,
        position: Sequence[float],
        quaternion: Sequence[float],
        speed: float,
        blending: float,
    ) -> None:
        """Moves the TCP on a straight line to a position and the orientation of a unit quaternion.

        position: x y z (mm)
        quaternion: qx qy qz qw
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        blending: radius round the target in which the next move may take over (mm), 0 <= blending
        """
        self._do(
            request(
                nothing("done"),
                "lin quaternion move",
                *exactly(3, "position", position),
                *exactly(4, "quaternion", quaternion),
                speed,
                blending,
            )
        )

    def ptp_quaternion_move(
        self,
        position: Sequence[float],
        quaternion: Sequence[float],
        speed: float,
        blending: float,
    ) -> None:
        """Moves the TCP, straight in joint space, to a position and the orientation of a unit quaternion.

        position: x y z (mm)
        quaternion: qx qy qz qw
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        blending: radius round the target in which the next move may take over (mm), 0 <= blending
        """
        self._do(
            request(
                nothing("done"),
                "ptp quaternion move",
                *exactly(3, "position", position),
                *exactly(4, "quaternion", quaternion),
                speed,
                blending,
            )
        )

    def lin_relative_move(self, shift: Sequence[float], speed: float, blending: float) -> None:
        """Moves the TCP on a straight line by a way and a turn in the axes of the base, from the end of the
        queue.

        shift: dx dy dz (mm) dalpha dbeta dgamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        blending: radius round the target in which the next move may take over (mm), 0 <= blending
        """
        self._do(request(nothing("done"), "lin relative move", *exactly(6, "shift", shift), speed, blending))

    def lin_tool_relative_move(self, shift: Sequence[float], speed: float, blending: float) -> None:
        """Moves the TCP on a straight line by a way and a turn in the axes of the tool, from the end of the
        queue.

        shift: dx dy dz (mm) dalpha dbeta dgamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        blending: radius round the target in which the next move may take over (mm), 0 <= blending
        """
        self._do(
            request(nothing("done"), "lin tool relative move", *exactly(6, "shift", shift), speed, blending)
        )

    def ptp_relative_move(self, shift: Sequence[float], speed: float, blending: float) -> None:
        """Moves the TCP straight in joint space, by a way and a turn in the axes of the base, from the end of
        the queue.

        shift: dx dy dz (mm) dalpha dbeta dgamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        blending: radius round the target in which the next move may take over (mm), 0 <= blending
        """
        self._do(request(nothing("done"), "ptp relative move", *exactly(6, "shift", shift), speed, blending))

    def ptp_tool_relative_move(self, shift: Sequence[float], speed: float, blending: float) -> None:
        """Moves the TCP straight in joint space, by a way and a turn in the axes of the tool, from the end of
        the queue.

        shift: dx dy dz (mm) dalpha dbeta dgamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        blending: radius round the target in which the next move may take over (mm), 0 <= blending
        """
        self._do(
            request(nothing("done"), "ptp tool relative move", *exactly(6, "shift", shift), speed, blending)
        )

    def linr_move(self, target: Sequence[float], speed: float, blending: float, r: float) -> None:
        """Moves the TCP on a straight line to a frame that is reached with the redundancy angle r.

        target: x y z (mm) alpha beta gamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        blending: radius round the target in which the next move may take over (mm), 0 <= blending
        r: redundancy angle: the position of joint A3 at the target (rad)
        """
        self._do(request(nothing("done"), "linr move", *exactly(6, "target", target), speed, blending, r))

    def ptpr_move(self, target: Sequence[float], speed: float, blending: float, r: float) -> None:
        """Moves the TCP, straight in joint space, to a frame that is reached with the redundancy angle r.

        target: x y z (mm) alpha beta gamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        blending: radius round the target in which the next move may take over (mm), 0 <= blending
        r: redundancy angle: the position of joint A3 at the target (rad)
        """
        self._do(request(nothing("done"), "ptpr move", *exactly(6, "target", target), speed, blending, r))

    def linforcez_move(
        self,
        target: Sequence[float],
        speed: float,
        blending: float,
        thresholdZ: float,
    ) -> None:
        """Moves as lin move does and ends early when the force along z has changed by more than its
        threshold.

        target: x y z (mm) alpha beta gamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        blending: radius round the target in which the next move may take over (mm), 0 <= blending
        thresholdZ: change of the force along z of the TCP that ends the move (N), 0 < thresholdZ
        """
        self._do(
            request(
                nothing("done"),
                "linforcez move",
                *exactly(6, "target", target),
                speed,
                blending,
                thresholdZ,
            )
        )

    def ptpforcez_move(
        self,
        target: Sequence[float],
        speed: float,
        blending: float,
        thresholdZ: float,
    ) -> None:
        """Moves as ptp move does and ends early when the force along z has changed by more than its
        threshold.

        target: x y z (mm) alpha beta gamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        blending: radius round the target in which the next move may take over (mm), 0 <= blending
        thresholdZ: change of the force along z of the TCP that ends the move (N), 0 < thresholdZ
        """
        self._do(
            request(
                nothing("done"),
                "ptpforcez move",
                *exactly(6, "target", target),
                speed,
                blending,
                thresholdZ,
            )
        )

    def linforce_move(
        self,
        target: Sequence[float],
        speed: float,
        blending: float,
        thresholdX: float,
        thresholdY: float,
        thresholdZ: float,
    ) -> None:
        """Moves as lin move does and ends early when a force has changed by more than its threshold.

        target: x y z (mm) alpha beta gamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        blending: radius round the target in which the next move may take over (mm), 0 <= blending
        thresholdX: change of the force along x of the TCP that ends the move (N), 0 < thresholdX
        thresholdY: change of the force along y of the TCP that ends the move (N), 0 < thresholdY
        thresholdZ: change of the force along z of the TCP that ends the move (N), 0 < thresholdZ
        """
        self._do(
            request(
                nothing("done"),
                "linforce move",
                *exactly(6, "target", target),
                speed,
                blending,
                thresholdX,
                thresholdY,
                thresholdZ,
            )
        )

    def ptpforce_move(
        self,
        target: Sequence[float],
        speed: float,
        blending: float,
        thresholdX: float,
        thresholdY: float,
        thresholdZ: float,
    ) -> None:
        """Moves as ptp move does and ends early when a force has changed by more than its threshold.

        target: x y z (mm) alpha beta gamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        blending: radius round the target in which the next move may take over (mm), 0 <= blending
        thresholdX: change of the force along x of the TCP that ends the move (N), 0 < thresholdX
        thresholdY: change of the force along y of the TCP that ends the move (N), 0 < thresholdY
        thresholdZ: change of the force along z of the TCP that ends the move (N), 0 < thresholdZ
        """
        self._do(
            request(
                nothing("done"),
                "ptpforce move",
                *exactly(6, "target", target),
                speed,
                blending,
                thresholdX,
                thresholdY,
                thresholdZ,
            )
        )

    def linstiff_move(
        self,
        target: Sequence[float],
        speed: float,
        stiffness: float,
        force: Sequence[float],
    ) -> None:
        """Moves the TCP on a straight line, yielding as a spring, and replaces the move that runs; adds the
        negative of the six force values.

        target: x y z (mm) alpha beta gamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        stiffness: translational stiffness at the TCP (N/m), 0 <= stiffness <= 5000
        force: fx fy fz (N) tx ty tz (Nm)
        """
        self._do(
            request(
                nothing("done"),
                "linstiff move",
                *exactly(6, "target", target),
                speed,
                stiffness,
                *exactly(6, "force", force),
            )
        )

    def ptpstiff_move(
        self,
        target: Sequence[float],
        speed: float,
        stiffness: float,
        force: Sequence[float],
    ) -> None:
        """Moves the TCP, straight in joint space, yielding as a spring, and replaces the move that runs; adds
        the negative of the six force values.

        target: x y z (mm) alpha beta gamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        stiffness: translational stiffness at the TCP (N/m), 0 <= stiffness <= 5000
        force: fx fy fz (N) tx ty tz (Nm)
        """
        self._do(
            request(
                nothing("done"),
                "ptpstiff move",
                *exactly(6, "target", target),
                speed,
                stiffness,
                *exactly(6, "force", force),
            )
        )

    def start_gravity(self, joint_stiffness: float) -> None:
        """Cancels the move that runs and holds the joints by springs where they then are, until stop or a
        stiffness move.

        joint_stiffness: stiffness of every joint (Nm/rad), 0 <= joint_stiffness <= 5000
        """
        self._do(request(nothing("done"), "start gravity", joint_stiffness))

    def smart_joint_move(self, joints: Sequence[float], speeds: Sequence[float]) -> None:
        """Heads for a joint position from wherever the robot is now.

        joints: j0 j1 j2 j3 j4 j5 j6 (rad)
        speeds: v0 v1 v2 v3 v4 v5 v6 (relative)
        """
        self._do(
            request(
                nothing("done"),
                "smart joint move",
                *exactly(7, "joints", joints),
                *exactly(7, "speeds", speeds),
            )
        )

    def smart_cartesian_move(self, target: Sequence[float], speed: float) -> None:
        """Heads with the flange for a frame from wherever the robot is now.

        target: x y z (mm) alpha beta gamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        """
        self._do(request(nothing("done"), "smart cartesian move", *exactly(6, "target", target), speed))

    def direct_joint_move(self, joints: Sequence[float], speeds: Sequence[float]) -> None:
        """Heads for a joint position at most 0.087 rad from the present one on any axis.

        joints: j0 j1 j2 j3 j4 j5 j6 (rad)
        speeds: v0 v1 v2 v3 v4 v5 v6 (relative)
        """
        self._do(
            request(
                nothing("done"),
                "direct joint move",
                *exactly(7, "joints", joints),
                *exactly(7, "speeds", speeds),
            )
        )

    def direct_cartesian_move(self, target: Sequence[float], speed: float) -> None:
        """Heads with the flange for a frame that no axis is more than 0.087 rad from.

        target: x y z (mm) alpha beta gamma (rad)
        speed: speed, relative to the velocity limits of the joints, 1e-06 <= speed <= 1
        """
        self._do(request(nothing("done"), "direct cartesian move", *exactly(6, "target", target), speed))

    def stop(self) -> None:
        """Brings the robot to rest on its path and discards all waiting moves."""
        self._do(request(nothing("done"), "stop"))

    def set_override(self, override: float) -> None:
        """Runs all motions at this share of their speed, on their paths, also those under way; 0 pauses, more
        resumes.

        override: rate at which motions run: 1 as planned, 0 a pause, between them at least 1e-6, 0 <=
            override <= 1
        """
        self._do(request(nothing("done"), "set override", override))

    def get_override(self) -> float:
        """Gives the override that was set last."""
        return self._do(request(number, "get override"))

    def set_collision_detection(self, max_force: float, max_torque: float) -> None:
        """Has the robot make a protective stop when a greater force or torque acts on the TCP from outside; 0
        switches one off.

        max_force: greatest force from outside at the TCP, 0 for off, else 0.001 or more (N), 0 <= max_force
            <= 100000
        max_torque: greatest torque from outside at the TCP, 0 for off, else 0.001 or more (Nm), 0 <=
            max_torque <= 100000
        """
        self._do(request(nothing("done"), "set collision detection", max_force, max_torque))

    def get_collision_detection(self) -> CollisionThresholds:
        """Gives the greatest force and torque that may act on the TCP from outside; 0 for one that is off."""
        return self._do(request(numbers(CollisionThresholds._make, 2), "get collision detection"))

    def set_tool_load(self, mass: float, centre: Sequence[float]) -> None:
        """Tells the controller what its arm carries: the difference to the true load acts from outside.

        mass: mass that the controller assumes at the flange (kg), 0 <= mass <= 1000
        centre: cx cy cz (mm)
        """
        self._do(request(nothing("done"), "set tool load", mass, *exactly(3, "centre", centre)))

    def get_tool_load(self) -> ToolLoad:
        """Gives the load at the flange that the controller assumes."""
        return self._do(request(numbers(ToolLoad._make, 4), "get tool load"))

    def cancel_move(self) -> None:
        """Ends the move that runs: brings the robot to rest on its path, and goes on with the next from
        there."""
        self._do(request(nothing("done"), "cancel move"))

    def clear_queue(self) -> None:
        """Discards the moves that wait; the one that runs ends at its target."""
        self._do(request(nothing("done"), "clear queue"))

    def get_queue(self) -> int:
        """Tells how many moves wait behind the one that runs."""
        return self._do(request(integer, "get queue"))

    def get_mode(self) -> str:
        """Tells the mode of the last move; unknown before the first, after a stop and after a servo
        timeout."""
        return self._do(
            request(one_of("unknown", "normal", "impedance", "smart", "direct", "trajectory"), "get mode")
        )

    def get_error(self) -> LastError:
        """Tells code and reason of the error state, else of the last refusal, else 0 none."""
        return self._do(request(last_error, "get error"))

    def reset_error(self) -> None:
        """Ends the error state, and forgets the last refusal."""
        self._do(request(nothing("done"), "reset error"))

    def get_robot_status(self) -> RobotStatus:
        """Gives the state of the robot in the fields and values of ROS-Industrial's RobotStatus."""
        return self._do(request(integers(RobotStatus._make, 7), "get robot status"))

    def get_status(self) -> str:
        """Tells moving or stopped; a robot that is paused on its way is moving."""
        return self._do(request(one_of("moving", "stopped"), "get status"))

    def get_tool_frame(self) -> Frame:
        """Gives the frame of the TCP in the base frame."""
        return self._do(request(numbers(Frame._make, 6), "get tool frame"))

    def get_flange_frame(self) -> Frame:
        """Gives the frame of the flange, without tool, in the base frame."""
        return self._do(request(numbers(Frame._make, 6), "get flange frame"))

    def get_joint_position(self) -> JointPosition:
        """Gives the positions of all joints."""
        return self._do(request(numbers(JointPosition._make, 7), "get joint position"))

    def get_joint_torque(self) -> JointTorque:
        """Gives the external torques on all joints."""
        return self._do(request(numbers(JointTorque._make, 7), "get joint torque"))

    def get_cartesian_force(self) -> CartesianForce:
        """Gives force and torque at the TCP, in TCP orientation."""
        return self._do(request(numbers(CartesianForce._make, 6), "get cartesian force"))

    def get_goal_frame(self) -> Frame:
        """Gives the frame of the TCP at the end of the move under way, or where the robot holds."""
        return self._do(request(numbers(Frame._make, 6), "get goal frame"))

    def get_goal_joint_position(self) -> JointPosition:
        """Gives the joint positions at the end of the move under way, or where the robot holds."""
        return self._do(request(numbers(JointPosition._make, 7), "get goal joint position"))

    def get_distance_to_goal(self) -> float:
        """Gives how far the TCP is from the end of the move under way."""
        return self._do(request(number, "get distance to goal"))

    def is_reachable(self, target: Sequence[float], r: float | None = None) -> Reachability:
        """Tells whether the TCP can be brought to a frame by PTP, and if not why: `reachable` or `unreachable
        CODE words`.

        target: x y z (mm) alpha beta gamma (rad)
        r, if given: redundancy angle: the position of joint A3 at the target (rad)
        """
        return self._do(
            request(reachability, "is reachable", *exactly(6, "target", target), *([] if r is None else [r]))
        )

    def is_lin_reachable(self, target: Sequence[float], r: float | None = None) -> Reachability:
        """Tells whether the TCP can go on a straight line to a frame from the end of the queue, as is
        reachable does.

        target: x y z (mm) alpha beta gamma (rad)
        r, if given: redundancy angle: the position of joint A3 at the target (rad)
        """
        return self._do(
            request(
                reachability,
                "is lin reachable",
                *exactly(6, "target", target),
                *([] if r is None else [r]),
            )
        )

    def set_output(self, n: int, value: bool) -> None:
        """Switches a digital output.

        n: number of a digital input or output, from 1
        value: state of an input or output: 1 is on, 0 <= value <= 1
        """
        self._do(request(nothing("done"), "set output", n, int(value)))

    def set_input(self, n: int, value: bool) -> None:
        """Always refused: what is wired to an input sets it, no driver can.

        n: number of a digital input or output, from 1
        value: state of an input or output: 1 is on, 0 <= value <= 1
        """
        self._do(request(nothing("error"), "set input", n, int(value)))

    def get_output(self, n: int) -> bool:
        """Gives the state of a digital output.

        n: number of a digital input or output, from 1
        """
        return self._do(request(state, "get output", n))

    def get_input(self, n: int) -> bool:
        """Gives the state of a digital input.

        n: number of a digital input or output, from 1
        """
        return self._do(request(state, "get input", n))

    def get_outputs(self) -> tuple[bool, ...]:
        """Gives the states of all digital outputs, from the first on."""
        return self._do(request(states, "get outputs"))

    def get_inputs(self) -> tuple[bool, ...]:
        """Gives the states of all digital inputs, from the first on."""
        return self._do(request(states, "get inputs"))
