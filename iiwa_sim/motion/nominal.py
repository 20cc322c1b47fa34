"""The nominal motion: what drive or servo makes, and how one takes over from the other."""

from collections.abc import Sequence

from iiwa_sim.motion.drive import Drive
from iiwa_sim.motion.even_kernel import Made
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.override import Override
from iiwa_sim.motion.pursuit import Pursuit, Stream
from iiwa_sim.motion.queue.move import Move
from iiwa_sim.motion.servo import Servo


class Nominal(Made):
    """Where one robot would be (rad), over ticks, if no force acted on it: drive or servo is active.

    Stiff, the robot is there. A robot that yields does so around that, and has its moves replaced: one that
    begins at rest runs in the drive as any other; one that comes in mid-motion takes the robot over with the
    position, velocity and acceleration it has, by the servo (`Pursuit`).
    """

    def __init__(self, drive: Drive, servo: Servo, override: Override) -> None:
        """All rest in the same place, and run at this override, which its owner steps before this."""
        self.drive = drive
        self.servo = servo
        self.active: Drive | Servo = drive
        self._override = override
        self._pursuit: Pursuit | None = None
        self._stream = Stream()

    @property
    def moving(self) -> bool:
        """Whether it is not at rest, or a pursuit has begun for which the servo has found no way yet."""
        return self.active.moving or (self._pursuit is not None and self.active is self.drive)

    @property
    def begins(self) -> Joints:
        """Where a move that replaces another begins now (rad), or where the stop ends that is under way."""
        return self.active.rest_after_stop() if self.active.stopping else self.active.joints

    @property
    def moves(self) -> Sequence[Move]:
        """What runs, and is not being stopped, and what waits in the drive: of replaced moves the newest."""
        if self._pursuit is None:
            return self.drive.moves
        return [self._pursuit.move] if self.moving else []

    @property
    def goal(self) -> Joints:
        """Where what runs, or a stop, ends (rad); at rest where the robot is."""
        return self.active.goal if self._pursuit is None else self._pursuit.move.path.end

    def rest_at(self, joints: Joints) -> None:
        """Be at rest at joint positions (rad), with nothing that waits."""
        self.drive.abandon()
        self.drive.start_from(joints)
        self.servo.start_from(joints)
        self.active, self._pursuit = self.drive, None

    def stop(self) -> None:
        """Stop on the path, and forget what waits in drive or servo."""
        self.drive.stop()
        self.servo.stop()
        self._pursuit = None

    def activate_servo(self) -> Servo:
        """Have the servo active, from rest where the robot is; gives it."""
        if self.active is not self.servo:
            self.servo.start_from(self.active.joints)
            self.active = self.servo
        return self.servo

    def begin_stream(self) -> None:
        """The move that begins next comes long after any other that it replaces."""
        self._stream = Stream()
        self._stream.heard()

    def replace(self, move: Move) -> bool:
        """Take a move in place of the one that runs, which ends; says whether one does, and is not stopped.

        If not, the move is to `begin` when nothing moves any more, which may be now.
        """
        self._stream.heard()
        under_way = self.active.moving if self.active is self.servo else self.drive.under_way
        self._pursuit = None
        if under_way and not self.active.stopping:
            limits = self._stream.limits_of(move, self.active.joints)
            self._pursuit = Pursuit(move, limits, self.drive, self.servo, self._override.tick_s)
            return True
        if not self.active.stopping:
            self.drive.abandon()  # a move that has not set out
        return False

    def begin(self, move: Move) -> None:
        """Carry out a move from rest."""
        self.rest_at(self.active.joints)
        self.drive.append(move)

    def step(self) -> None:
        """A tick of a robot that yields. What drive or servo raise is raised."""
        self._stream.advance(self._override.advance_s)
        if not self.moving:
            self._pursuit = None
            return
        if self._pursuit is not None:
            self.active = self._pursuit.step(self.active)
        self.active.step()
