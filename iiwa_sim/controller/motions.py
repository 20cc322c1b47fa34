"""What moves the robot: one queue of moves, a servo, and how the robot gives way around either."""

from iiwa_sim.controller.wanted import Hold, Planned, StiffnessMove, Target, Tracked, planned_of
from iiwa_sim.controller.yielding import Yielding
from iiwa_sim.motion.drive import Drive
from iiwa_sim.motion.even_kernel import EvenMotions
from iiwa_sim.motion.follower import Follower
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.nominal import Nominal
from iiwa_sim.motion.override import Override
from iiwa_sim.motion.queue.move import Move
from iiwa_sim.motion.servo import Servo
from iiwa_sim.motion.surroundings import COMPLIANT_JOINTS, COMPLIANT_TCP, STIFF
from iiwa_sim.motion.trajectory.reference import Reference
from iiwa_sim.motion.trajectory.tracking_plan import Followed, TrackingPlan, tracking_plan


class Motions(EvenMotions):
    """The motions of one robot, and what waits to become one.

    A nominal motion is made by the drive, in which normal moves queue, or by the servo, which heads for
    targets and follows joint trajectories. Stiff, the robot is where that is; else the follower says where it
    gives way to. Of what replaces the motion before, targets, trajectories, stiffness moves and holds, the
    newest waits here until that has come to rest after a `stop`.
    """

    def __init__(self, nominal: Nominal, follower: Follower, override: Override) -> None:
        """All at rest in the same place, at the rate of this override."""
        self.joints = nominal.active.joints
        self._override: Override = override
        self._nominal: Nominal = nominal
        self.drive: Drive = nominal.drive
        self._servo = nominal.servo
        self._follower: Follower = follower
        self._yielding = Yielding(nominal, follower)
        self._next: Target | Tracked | StiffnessMove | Hold | None = None
        self._newest: int | None = None  # the number of the newest of these, until it is stopped or cancelled
        self._following = False  # the servo is active for targets, and has not been stopped
        self.tracking = False
        """Whether the servo is active for a trajectory, and has not been stopped."""

    def moves_otherwise(self) -> bool:
        """Whether anything moves, is being stopped, or waits, with no chain in the drive."""
        return self.drive.moving or self._next is not None or self._nominal.moving or self._follower.moving

    @property
    def settled(self) -> bool:
        """Whether ticks change nothing until something is asked for: a robot that yields is never sure."""
        return not self.moving and self._override.settled and not self._follower.yielding

    @property
    def override(self) -> float:
        """The rate that was asked for, 0..1."""
        return self._override.value

    def set_override(self, value: float) -> None:
        """Run what moves and what will at this rate (0..1): as soon as limits allow, at rest at once."""
        if self.moving:
            self._override.go_to(value)
        else:
            self._override.be(value)

    @property
    def pausing(self) -> bool:
        """Whether what moves has come to a standstill by an override of 0."""
        return self.moving and self._override.pausing

    @property
    def compliance(self) -> int:
        """How the robot gives way now: `STIFF`, `COMPLIANT_TCP` or `COMPLIANT_JOINTS`."""
        if not self._follower.yielding:
            return STIFF
        return COMPLIANT_JOINTS if self._follower.holding else COMPLIANT_TCP

    @property
    def holding(self) -> bool:
        """Whether a gravity hold is on, or begins when the robot is at rest."""
        return self._follower.holding or self.holds_next

    @property
    def holds_next(self) -> bool:
        """Whether a gravity hold begins when the robot is at rest."""
        return isinstance(self._next, Hold)

    @property
    def behind(self) -> int:
        """Moves behind the one that runs, or begins in the next tick; all that wait while the robot stops."""
        if isinstance(self._next, StiffnessMove | Hold):
            return int(self._being_stopped)
        return self.drive.waiting if self._queue_waits else self.drive.behind

    @property
    def rest(self) -> Joints:
        """Where the next normal move begins (rad): where all that waits ends, or a stop."""
        drive, active = self.drive, self._nominal.active
        return drive.rest if active is drive or drive.moving else active.rest

    @property
    def yielding_from(self) -> Joints:
        """Where the next stiffness move begins (rad): where the nominal motion is, or where a stop ends."""
        return self._yielding.begins if self._follower.yielding else self._nominal.active.rest

    def rest_after_stop(self) -> Joints:
        """Where the robot would come to rest if it were stopped now (rad)."""
        if self._follower.off_plan:
            return self._follower.rest_after_stop()
        return self._nominal.active.rest_after_stop()

    @property
    def present(self) -> Joints:
        """Where the next servo target sets out from, as far as is known now (rad)."""
        return self.joints if self._following else self.rest_after_stop()

    @property
    def tracked(self) -> Followed | None:
        """The joint trajectory that is followed and has not been stopped; None while there is none."""
        servo = self._servo
        return (
            Followed(servo.course, servo.time_s)
            if self.tracking and isinstance(servo.course, TrackingPlan)
            else None
        )

    def plan_way(self, reference: Reference, limits: JointLimits) -> TrackingPlan:
        """How to follow a trajectory in place of the one before, or from where the robot will rest. Raises
        `ArithmeticError` where no way onto it is found."""
        here = self.rest_after_stop()
        still = (0.0,) * len(here)
        state = self._servo.state if self.tracked else (here, still, still)
        return tracking_plan(reference, state, limits, self._servo.courses)

    @property
    def goal(self) -> Joints:
        """Where what moves now ends: a move, a target, a stop (rad); of a hold, where it keeps the joints.

        Where nothing has begun to move, that of what begins next, or where the robot is.
        """
        if self._follower.holding:
            return self._follower.centre
        if self._follower.braking:
            return self.rest_after_stop()
        if not self._nominal.moving:
            if self._next is not None and not isinstance(self._next, Hold):
                return self._next.end
            if self.drive.moving:
                return self.drive.goal
        return self._nominal.goal

    @property
    def planned(self) -> list[Planned]:
        """What runs, and is not being stopped, and what waits, in its order; holds, without a target, not."""
        if self._next is not None and not isinstance(self._next, Hold):
            return [self._next.planned]
        if self.holding:
            return []
        if (self._following or self.tracking) and self._newest is not None:
            active = self._nominal.active
            return [Planned(self._newest, active.goal, 0.0)] if active.moving else []
        return [planned_of(move) for move in self._nominal.moves]

    def is_pending(self, number: int) -> bool:
        """Whether a move, a target, a trajectory or a hold of this number is under way or waits."""
        if number == self._newest:
            return self._next is not None or self._follower.holding or self._nominal.moving
        return not self._follower.yielding and self.drive.is_pending(number)

    def append(self, move: Move) -> None:
        """Queue a move that begins at `rest`. Other motions must have been stopped."""
        if self._nominal.active is not self.drive and not self.drive.moving:
            self.drive.start_from(self._nominal.active.rest)
        self.drive.append(move)

    def head_for(self, target: Target) -> None:
        """Head for a target, at once or from rest. Other motions must have been stopped."""
        if self._following:
            self._servo.head_for(target.end, target.limits)
        else:
            self._next = target
        self._newest = target.number

    def track(self, wanted: Tracked) -> None:
        """Follow a trajectory by a way planned since the last tick: at once, or when the robot has come to
        rest. Other motions must have been stopped."""
        if self.tracked:
            self._servo.follow(wanted.way)
        else:
            self._next, self.tracking = wanted, False
        self._newest = wanted.number

    def end_trajectory(self) -> None:
        """Stop on the way of the trajectory that is followed, or forget the one that waits."""
        if isinstance(self._next, Tracked):
            self._next = self._newest = None
        elif self.tracked:
            self._servo.stop()
            self.tracking, self._newest = False, None

    def yield_around(self, wanted: StiffnessMove) -> None:
        """Carry out a move that begins at `yielding_from`, in place of what runs: from rest as any move, in
        mid-motion without a stop, or when a stop under way is over. Other motions must have been stopped."""
        self._newest = wanted.move.number
        replaced = self._follower.yielding and self._yielding.replace(wanted)
        self._next = None if replaced else wanted

    def hold(self, wanted: Hold) -> None:
        """Hold the joints where the robot comes to rest. Other motions must have been stopped."""
        self._newest = wanted.number
        held = self._follower.yielding and self._yielding.hold(wanted)
        self._next = None if held else wanted

    def stop(self) -> None:
        """Stop, and forget what waits: on the path, or from the velocity of a robot that is off it."""
        self._yielding.stop()
        self._nominal.stop()
        self._next = self._newest = None
        self._following = self.tracking = False

    def cancel(self) -> None:
        """End what runs, or begins in the next tick: a move as `Drive.cancel` does, a trajectory, a target.

        A robot that yields goes on to do so. While it is being stopped, and in a hold, nothing changes.
        """
        if self._being_stopped or self.holding:
            return
        if self._next is not None:
            self._next = self._newest = None
        elif self._following or self.tracking or self._follower.yielding:
            if self._nominal.moving:
                self._nominal.stop()
                self._following = self.tracking = False
            self._newest = None
        else:
            self.drive.cancel()

    def clear(self) -> None:
        """Forget the moves behind the one that runs, or begins in the next tick."""
        if isinstance(self._next, StiffnessMove | Hold):
            if self._being_stopped:
                self._next = self._newest = None
        elif self._queue_waits:
            self.drive.stop()  # all of them wait
        elif not self._follower.yielding:
            self.drive.clear()

    def make_step(self) -> None:
        """A tick of any kind."""
        follower, active = self._follower, self._nominal.active
        if not self._override.level:
            self._override.step(None if follower.active or active is not self.drive else self.drive)
        try:
            if not follower.active and not active.moving:
                active = self._hand_over()
            if not follower.active:
                active.step()
                self.joints = active.joints
            else:
                if follower.braking:
                    follower.brake()
                elif self._yielding.step(self._next):
                    self._next = None
                self.joints = follower.joints
        except Exception:
            self.stop()
            raise

    @property
    def _being_stopped(self) -> bool:
        return self._nominal.active.stopping or self._follower.braking

    @property
    def _queue_waits(self) -> bool:
        """Whether all normal moves wait until something else has come to rest."""
        active = self._nominal.active
        return self._follower.braking or (active is not self.drive and active.moving)

    def _hand_over(self) -> Drive | Servo:
        """Begin what waits, as nothing moves any more; gives what makes the nominal motion."""
        nominal = self._nominal
        match self._next:
            case Target() as target:
                self._next = None
                nominal.activate_servo().head_for(target.end, target.limits)
                self._following = True
            case Tracked(way=way):
                self._next = None
                nominal.activate_servo().follow(way)
                self.tracking = True
            case StiffnessMove() | Hold():
                self._yielding.start()
            case None if self.drive.moving:
                nominal.active = self.drive
        return nominal.active
