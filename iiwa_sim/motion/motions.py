"""The motions of a robot: one queue of moves, a servo, and the compliance around either."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from iiwa_sim.contact.tcp_contact_kernel import TcpContact, TcpState
from iiwa_sim.frames import Transform
from iiwa_sim.motion.blend import Move
from iiwa_sim.motion.executor import Executor
from iiwa_sim.motion.impedance import COMPLIANT_JOINTS, COMPLIANT_TCP, STIFF, Impedance, Pushes
from iiwa_sim.motion.joint_trajectory import JointTrajectory, Reference, joint_trajectory
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.servo import Servo
from iiwa_sim.motion.springs import CartesianImpedance
from iiwa_sim.motion.time_scaling import TimeScaling
from iiwa_sim.robot.arm_kernel import Kinematics
from iiwa_sim.robot.inverse import Inverse
from iiwa_sim.robot.model import Model


class _Next(NamedTuple):
    """A motion that begins when the robot rests."""

    begin: Callable[[], None]
    end: Joints | None
    """rad; None for a hold"""
    compliant: bool = False


class Motions:
    """The motions of one robot, and the one that waits to begin.

    The executor makes the nominal motion: it runs queued moves and trajectories of the servo. A stiff robot
    follows that exactly; the impedance deflects a compliant robot from it. Targets, trajectories, stiffness
    moves and holds replace the motion before: the newest waits here until the robot rests after a `stop`.
    """

    def __init__(
        self,
        model: Model,
        tool_in_flange: Transform,
        start: Joints,
        tick_s: float,
        limits: JointLimits,
        pushes: Pushes,
        contact: TcpContact | None,
    ) -> None:
        """Rest at joint positions `start` (rad).

        `limits` are those of smart mode at full speed. `pushes` and the `contact` at its TCP deflect a
        compliant robot.
        """
        d = model.description
        self.joints = start
        """Joint positions (rad)."""
        self.tracking = False
        """True if a trajectory is followed and has not been stopped."""
        time = TimeScaling(tick_s, d.stop_rate_per_s, d.stop_rate_change_per_s2)
        self.executor = Executor(start, time, np.array(d.position_min), np.array(d.position_max))
        """Makes the nominal motion."""
        self._servo = Servo(self.executor, limits, d.position_min, d.position_max)
        kinematics = Kinematics(model, Inverse(model), tool_in_flange)
        self._impedance = Impedance(start, tick_s, d, kinematics, pushes, contact)
        self._next_impedance: CartesianImpedance | None = None  # of a stiffness move that has not set out
        self._next: _Next | None = None
        self._newest: int | None = None  # the number of the newest of these, until it is stopped or cancelled
        self._following = False  # the servo heads for targets, and has not been stopped

    @property
    def moving(self) -> bool:
        """True if anything moves, is being stopped, or waits."""
        return (
            self.executor.trajectory is not None
            or self._impedance.moving
            or self._next is not None
            or self._servo.moving
        )

    @property
    def ends_by_itself(self) -> bool:
        """True if anything moves and stops without a command: not in a pause, nor in a hold or before one."""
        return self.moving and not (self.executor.time.pausing or self.holding)

    @property
    def settled(self) -> bool:
        """True if ticks change nothing without a new request; never for a compliant robot."""
        return not self.moving and not self._impedance.compliant

    @property
    def pausing(self) -> bool:
        """True if a motion has come to a standstill by an override of 0."""
        return self.moving and self.executor.time.pausing

    @property
    def holding(self) -> bool:
        """True if a gravity hold is on, or begins when the robot is at rest."""
        return self._impedance.holding or (self._next is not None and self._next.end is None)

    @property
    def compliance(self) -> int:
        """Compliance of the robot now: `STIFF`, `COMPLIANT_TCP` or `COMPLIANT_JOINTS`."""
        if not self._impedance.compliant:
            return STIFF
        return COMPLIANT_JOINTS if self._impedance.holding else COMPLIANT_TCP

    @property
    def tcp_contact(self) -> TcpState | None:
        """TCP after the last tick and its contact there, if that is known."""
        return self._impedance.tcp_contact

    @property
    def coming(self) -> Joints | None:
        """Joints after the next tick (rad) without a new request; None while the robot is compliant."""
        return None if self._impedance.active else self.executor.coming

    @property
    def under_way(self) -> int:
        """The number of the normal move that runs and is not being stopped, 0 where there is none."""
        return 0 if self._impedance.active else self.executor.under_way

    @property
    def behind(self) -> int:
        """Moves behind the one that runs, or begins in the next tick; all that wait while the robot stops."""
        if self._next is not None and self._next.compliant:
            return int(self._being_stopped)
        return self.executor.waiting if self._impedance.braking else self.executor.behind

    @property
    def compliant_start(self) -> Joints:
        """Start of the next stiffness move (rad): the nominal motion, or the end of a stop."""
        executor, impedance = self.executor, self._impedance
        if not impedance.compliant:
            return executor.rest
        if impedance.holding:
            return impedance.joints
        return executor.rest_after_stop() if executor.stopping else executor.joints

    def rest_after_stop(self) -> Joints:
        """Place of rest after a stop now (rad)."""
        return (self._impedance if self._impedance.off_plan else self.executor).rest_after_stop()

    @property
    def present(self) -> Joints:
        """Start of the next servo target, if it is known (rad)."""
        return self.joints if self._following else self.rest_after_stop()

    @property
    def tracked(self) -> JointTrajectory | None:
        """The joint trajectory that is followed and has not been stopped; None while there is none."""
        trajectory = self.executor.trajectory
        return trajectory if self.tracking and isinstance(trajectory, JointTrajectory) else None

    @property
    def tracked_s(self) -> float:
        """Time since that trajectory began, at the rate of the override."""
        return self.executor.time.time_s

    def plan_trajectory(self, reference: Reference, limits: JointLimits) -> JointTrajectory:
        """Return a trajectory from the one before or from rest; raises `ArithmeticError` if none is found."""
        here = self.rest_after_stop()
        still = (0.0,) * len(here)
        state = self.executor.state if self.tracked is not None else (here, still, still)
        return joint_trajectory(reference, state, limits, self._servo.planner)

    @property
    def goal(self) -> Joints:
        """End of the running move, target or stop (rad); of a hold, the joints that it keeps.

        Before a motion it is the end of what begins next; at rest the present position.
        """
        if self._impedance.holding:
            return self._impedance.centre
        if self._impedance.braking:
            return self.rest_after_stop()
        if self._next is not None and self._next.end is not None and not self._servo.moving:
            return self._next.end
        pursued = self._servo.pursued
        return self.executor.goal if pursued is None else pursued.path.end

    @property
    def count(self) -> int:
        """Number of moves, targets and trajectories that wait, or run and are not being stopped."""
        if self.holding:
            return 0
        if self._next is not None or self._newest is not None:
            return int(self._next is not None or self._servo.moving)
        return len(self.executor.moves)

    def is_pending(self, number: int) -> bool:
        """Return True if a move, a target, a trajectory or a hold of this number runs or waits."""
        if number == self._newest:
            return self._next is not None or self._impedance.holding or self._servo.moving
        return not self._impedance.compliant and self.executor.is_pending(number)

    def head_for(self, number: int, joints: Joints, limits: JointLimits) -> None:
        """Head for joint positions (rad), at once or from rest. Other motions must have been stopped."""
        if self._following:
            self._servo.head_for(joints, limits)
        else:
            begin = partial(self._begin_following, joints, limits)
            self._next = _Next(begin, joints)
        self._newest = number

    def track(self, number: int, trajectory: JointTrajectory) -> None:
        """Follow a trajectory planned since the last tick: at once, or when the robot has come to rest.

        Other motions must have been stopped.
        """
        if self.tracked:
            self.executor.follow(trajectory)
        else:
            begin = partial(self._begin_tracking, trajectory)
            self._next, self.tracking = _Next(begin, trajectory.end), False
        self._newest = number

    def end_trajectory(self) -> None:
        """Stop on the trajectory that is followed, or forget the one that waits."""
        if self._next is not None:
            self._next = self._newest = None
        elif self.tracked:
            self.executor.stop()
            self.tracking, self._newest = False, None

    def move_compliantly(self, move: Move, impedance: CartesianImpedance) -> None:
        """Carry out a move that begins at `compliant_start`, in place of the running motion.

        It begins from rest, in mid-motion without a stop, or after a stop. Other motions must have
        been stopped.
        """
        self._newest = move.number
        if self._impedance.holding:
            self._impedance.let_go()
            self.executor.rest_at(self._impedance.joints)
            self._servo.begin_stream()
        if self._impedance.compliant and self._servo.replace(move):
            self._next, self._next_impedance = None, impedance
        else:
            begin = partial(self._begin_move, move, impedance)
            self._next, self._next_impedance = _Next(begin, move.path.end, compliant=True), None

    def hold(self, number: int, stiffness_nm_per_rad: float) -> None:
        """Hold the joints where the robot comes to rest. Other motions must have been stopped."""
        self._newest, self._next = number, None
        if self._impedance.holding:
            self._impedance.hold(stiffness_nm_per_rad)
            return
        self._next = _Next(partial(self._begin_hold, stiffness_nm_per_rad), None, compliant=True)
        if self._impedance.compliant and self._servo.moving:
            self._stop_nominal()

    def stop(self) -> None:
        """Stop, and drop waiting motions: on the path, or from the velocity of a robot that is off it."""
        if self._impedance.off_plan:
            self.executor.rest_at(self._impedance.rest_after_stop())
        self._impedance.stop()
        self._stop_nominal()
        self._next = self._newest = self._next_impedance = None

    def cancel(self) -> None:
        """End the motion that runs, or begins in the next tick: a move, a trajectory, a target.

        A compliant robot stays compliant. While it is being stopped, and in a hold, nothing changes.
        """
        if self._being_stopped or self.holding:
            return
        if self._next is not None:
            self._next = self._newest = None
        elif self._following or self.tracking or self._impedance.compliant:
            if self._servo.moving:
                self._stop_nominal()
            self._newest = None
        else:
            self.executor.cancel()

    def clear(self) -> None:
        """Forget the moves behind the one that runs, or begins in the next tick."""
        if self._next is not None and self._next.compliant:
            if self._being_stopped:
                self._next = self._newest = None
        elif self._impedance.braking:
            self.executor.stop()  # all of them wait
        elif not (self._impedance.compliant or self._following or self.tracking):
            self.executor.clear()

    def step(self) -> None:
        """Make one tick. If a motion fails, the robot stops, and the exception of the motion is raised."""
        impedance, executor = self._impedance, self.executor
        if not impedance.active and executor.step_quietly():
            self.joints = executor.joints
            return
        try:
            if impedance.braking is None and not (impedance.holding and self._next is None):
                self._step_nominal()
            if impedance.active:
                impedance.step(executor.joints)
            self.joints = impedance.joints if impedance.active else executor.joints
        except Exception:
            self.stop()
            raise

    def _step_nominal(self) -> None:
        """Make a tick of the nominal motion, and begin the next motion once that is at rest."""
        executor, impedance = self.executor, self._impedance
        if self._next is not None and not self._servo.moving:
            coming, self._next = self._next, None
            coming.begin()
        if impedance.holding:
            return
        self._servo.step()
        executor.step()
        if self._next_impedance is not None and not executor.waiting:
            impedance.impedance, self._next_impedance = self._next_impedance, None

    @property
    def _being_stopped(self) -> bool:
        return self.executor.stopping or self._impedance.braking is not None

    def _stop_nominal(self) -> None:
        self.executor.stop()
        self._servo.stop()
        self._following = self.tracking = False

    def _begin_following(self, joints: Joints, limits: JointLimits) -> None:
        self._servo.head_for(joints, limits)
        self._following = True

    def _begin_tracking(self, trajectory: JointTrajectory) -> None:
        self.executor.follow(trajectory)
        self.tracking = True

    def _begin_move(self, move: Move, impedance: CartesianImpedance) -> None:
        self._start_compliance()
        self.executor.rest_at(self.executor.joints)
        self.executor.append(move)
        self._next_impedance = impedance

    def _begin_hold(self, stiffness_nm_per_rad: float) -> None:
        self._start_compliance()
        self._impedance.hold(stiffness_nm_per_rad)

    def _start_compliance(self) -> None:
        if not self._impedance.compliant:
            self._impedance.start(self.executor.joints)
            self._servo.begin_stream()
