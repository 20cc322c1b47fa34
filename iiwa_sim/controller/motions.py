"""What moves the robot: normal moves, a servo or impedance, one of them at a time."""

from typing import NamedTuple

from iiwa_sim.motion.compliance_kernel import Manner
from iiwa_sim.motion.drive import Drive
from iiwa_sim.motion.impedance import Impedance
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.override import Override
from iiwa_sim.motion.queue.move import Move
from iiwa_sim.motion.servo import Servo
from iiwa_sim.wrench import TcpContact


class Target(NamedTuple):
    """Where a servo heads for, and within which limits."""

    number: int
    """Moves and targets are numbered together, in the order in which they were accepted."""
    joints: Joints
    limits: JointLimits


class Motions:
    """The drive, the servo and the impedance of one robot.

    One of them is active. Another takes over when that one has come to rest after a `stop`: normal moves then
    wait in the drive, the newest stiffness move or hold in the impedance, the newest servo target here.
    """

    def __init__(self, drive: Drive, servo: Servo, impedance: Impedance, override: Override) -> None:
        """All at rest in the same place, at the rate of this override."""
        self._override = override
        self._drive = drive
        self._servo = servo
        self._impedance = impedance
        self._active: Drive | Servo | Impedance = drive
        self._next_target: Target | None = None
        self._following = False  # the servo is active and has not been stopped
        self._newest_target = 0  # its number

    @property
    def joints(self) -> Joints:
        """Joint positions (rad)."""
        return self._active.joints

    @property
    def tcp_contact(self) -> TcpContact | None:
        """Where the TCP has come to in the last tick, and what it touches there, where that is known."""
        return self._impedance.tcp_contact if self._active is self._impedance else None

    @property
    def moving(self) -> bool:
        """Whether anything moves, is being stopped, or waits."""
        if self._active.moving or self._next_target is not None:
            return True
        return self._drive.moving or self._servo.moving or self._impedance.moving

    @property
    def settled(self) -> bool:
        """Whether ticks change nothing until something is asked for: a robot that yields is never sure."""
        return not self.moving and self._override.settled and not self._impedance.yielding

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
    def waiting(self) -> int:
        """Moves in the drive that have not begun."""
        return self._drive.waiting

    @property
    def holding(self) -> bool:
        """Whether a gravity hold is on, or begins when the robot is at rest."""
        return self._impedance.holding

    @property
    def behind(self) -> int:
        """Moves behind the one that runs, or begins in the next tick; all that wait while the robot stops."""
        return self._queue.waiting if self._queue_waits else self._queue.behind

    @property
    def under_way(self) -> int:
        """The number of the move that runs and is not being stopped, 0 where there is none."""
        return self._drive.under_way if self._active is self._drive else 0

    @property
    def rest(self) -> Joints:
        """Where the next move of the drive begins (rad): where all that waits ends, or a stop."""
        return self._drive.rest if self._drive.moving else self._active.rest

    @property
    def yielding_from(self) -> Joints:
        """Where the next move of the impedance begins (rad): where its plan is, or where a stop ends."""
        return self._impedance.rest if self._impedance.moving else self._active.rest

    def rest_after_stop(self) -> Joints:
        """Where the robot would come to rest if it were stopped now (rad)."""
        return self._active.rest_after_stop()

    @property
    def present(self) -> Joints:
        """Where the next servo target sets out from, as far as is known now (rad)."""
        return self.joints if self._following else self.rest_after_stop()

    @property
    def goal(self) -> Joints:
        """Where what moves now ends: a move, a target, a stop (rad).

        Where nothing has begun to move, that of what begins next, or where the robot is.
        """
        if not self._active.moving:
            if self._next_target is not None:
                return self._next_target.joints
            if self._queue.moving:
                return self._queue.goal
        return self._active.goal

    def is_pending(self, number: int) -> bool:
        """Whether a move or a target of this number is being headed for or waits."""
        if number != self._newest_target:
            return self._drive.is_pending(number) or self._impedance.is_pending(number)
        return self._next_target is not None or (self._following and self._servo.moving)

    def append(self, move: Move) -> None:
        """Queue a move that begins at `rest`. Other motions must have been stopped."""
        if self._active is not self._drive and not self._drive.moving:
            self._drive.start_from(self._active.rest)
        self._drive.append(move)

    def head_yielding(self, move: Move, manner: Manner) -> None:
        """Carry out a move that begins at `yielding_from`, in place of the one before. Other motions must
        have been stopped."""
        self._prepare_impedance()
        self._impedance.head_for(move, manner)

    def hold(self, number: int, stiffness_nm_per_rad: float) -> None:
        """Hold the joints where the robot comes to rest. Other motions must have been stopped."""
        self._prepare_impedance()
        self._impedance.hold(number, stiffness_nm_per_rad)

    def head_for(self, target: Target) -> None:
        """Head for a target at once, or when the robot has come to rest. Other motions must have been
        stopped."""
        if self._following:
            self._servo.head_for(target.joints, target.limits)
        else:
            self._next_target = target
        self._newest_target = target.number

    def stop(self) -> None:
        """Stop on the path, and forget what waits."""
        self._drive.stop()
        self._servo.stop()
        self._impedance.stop()
        self._next_target = None
        self._following = False

    def cancel(self) -> None:
        """End what runs, or begins in the next tick: a move as `Drive.cancel` does, or a servo's target.

        While the robot is being stopped nothing runs, and nothing changes.
        """
        if self._following:
            if self._servo.moving:
                self._servo.stop()
                self._following = False
        elif self._next_target is not None:
            if not self._active.moving:
                self._next_target = None
        elif not self._queue_waits:
            self._queue.cancel()

    def clear(self) -> None:
        """Forget the moves behind the one that runs, or begins in the next tick."""
        if self._queue_waits:
            self._queue.stop()  # all of them wait
        else:
            self._queue.clear()

    @property
    def _queue(self) -> Drive | Impedance:
        """What moves wait in, or would: of the two that are not active, one at most has any."""
        for motion in (self._drive, self._impedance):
            if motion is not self._active and motion.moving:
                return motion
        return self._impedance if self._active is self._impedance else self._drive

    @property
    def _queue_waits(self) -> bool:
        """Whether its moves wait until another motion has come to rest."""
        return self._queue is not self._active and self._active.moving

    def step(self) -> None:
        """One tick. Where the active motion fails, what waits is forgotten, and what it raised is raised."""
        self._override.step(self._drive if self._active is self._drive else None)
        if not self._active.moving:
            self._hand_over()
        try:
            self._active.step()
        except Exception:
            self._drive.stop()
            self._impedance.stop()
            self._next_target = None
            raise

    def _prepare_impedance(self) -> None:
        if self._active is not self._impedance and not self._impedance.moving:
            self._impedance.start_from(self._active.rest)

    def _hand_over(self) -> None:
        target = self._next_target
        if target is not None:
            if self._active is not self._servo:
                self._servo.start_from(self._active.joints)
                self._active = self._servo
            self._next_target = None
            self._servo.head_for(target.joints, target.limits)
            self._following = True
        elif self._drive.moving:
            self._active = self._drive
        elif self._impedance.moving:
            self._active = self._impedance
