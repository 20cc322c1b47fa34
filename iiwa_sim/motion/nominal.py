"""The nominal motion of impedance: the newest move replaces the one before, without a stop between."""

from math import inf

import numpy as np

from iiwa_sim.motion.drive import Drive
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.override import Override
from iiwa_sim.motion.pursuit import Pursuit
from iiwa_sim.motion.queue.move import Move
from iiwa_sim.motion.servo import Servo

REPLAN_S = 0.008
"""So often a robot that has been sent elsewhere in mid-motion is headed for another point of its path."""

LONGEST_PERIOD_S = 0.12
"""Moves that come so soon one after the other are a stream."""
PERIODS = 2.0
"""A move of a stream takes so many of its periods at the least: then the next one comes before it brakes, and
the robot goes on evenly, a period behind what it is told. With fewer it would stop and go."""
LEAST_SPEED = 1e-3
"""What a joint with hardly a way keeps for corrections, as a part of its velocity limit; and at least what it
reaches at its acceleration limit in ..."""
LEAST_S = 3e-4
"""... this time: after it has passed its path it has to come back."""


class Nominal:
    """Joint positions (rad) over ticks.

    A move that begins at rest runs along its path as any other does (`Drive`). One that comes while the robot
    moves takes it over with the position, velocity and acceleration it has, and brings it onto its own path
    and to its end (`Pursuit`), within its limits (`Servo`). One that comes while the robot is being stopped
    begins when that is at rest.
    """

    def __init__(self, drive: Drive, servo: Servo, override: Override) -> None:
        """Both rest in the same place, and run at this override, which its owner steps before this."""
        self._drive = drive
        self._override = override
        self._servo = servo
        self._active: Drive | Servo = drive
        self._replan_ticks = max(round(REPLAN_S / override.tick_s), 1)
        self._pursuit: Pursuit | None = None
        self._ticks = 0  # since the pursuit looked ahead
        self._next: Move | None = None  # begins when the stop under way is over
        self._stopped = False  # by `stop`, since the last move has begun
        self._since_s = inf  # of planned time, since the newest move has come
        self._period_s = inf  # between that and the one before

    @property
    def joints(self) -> Joints:
        """Joint positions (rad)."""
        return self._active.joints

    @property
    def moving(self) -> bool:
        """Whether a move runs, is being stopped, or waits."""
        return self._active.moving or self._next is not None or self._not_taken_over

    @property
    def _not_taken_over(self) -> bool:
        """Whether a pursuit has begun for which the servo has found no way yet."""
        return self._pursuit is not None and self._active is self._drive

    @property
    def stopping(self) -> bool:
        """Whether a stop is under way."""
        return self._stopped and self._active.moving

    @property
    def begins(self) -> Joints:
        """Where a move would begin that came now (rad): where the robot is, or would rest after its stop."""
        return self._active.rest_after_stop() if self.stopping else self._active.joints

    @property
    def waits(self) -> bool:
        """Whether a move has not begun."""
        return self._next is not None or (self._active is self._drive and self._drive.waiting > 0)

    @property
    def goal(self) -> Joints:
        """Where the newest move, or a stop, ends (rad); at rest where the robot is."""
        if self._pursuit is not None:
            return self._pursuit.move.path.end
        return self._active.goal

    def head_for(self, move: Move) -> None:
        """Carry out a move that begins at `begins`; the one before is over."""
        if self._since_s > 0.0:
            self._period_s, self._since_s = self._since_s, 0.0
        if self.stopping:
            self._next = move
        elif self._active.moving and (self._active is self._servo or self._drive.under_way):
            self._pursuit, self._ticks = Pursuit(move, self._limits_of(move)), self._replan_ticks
        else:
            self._begin(move)

    def rest_after_stop(self) -> Joints:
        """Where the robot would come to rest if it were stopped now (rad)."""
        return self._active.rest_after_stop()

    def stop(self) -> None:
        """Stop on the way there is, and forget what waits."""
        self._active.stop()
        self._next = self._pursuit = None
        self._stopped = True

    def step(self) -> None:
        """A tick. What the motion raises is raised: the robot then rests where it is, or can be stopped."""
        self._since_s += self._override.advance_s
        if not self._active.moving and not self._not_taken_over:
            self._stopped, self._pursuit = False, None
            if self._next is None:
                return
            self._begin(self._next)
        self._look_ahead()
        self._active.step()

    def _begin(self, move: Move) -> None:
        """From rest."""
        joints = self._active.joints
        self._drive.abandon()
        self._drive.start_from(joints)
        self._drive.append(move)
        self._active, self._next, self._pursuit = self._drive, None, None
        self._stopped = False

    def _limits_of(self, move: Move) -> JointLimits:
        """Limits of the move; in a stream of moves so low that the next one comes before this one is done."""
        if self._period_s > LONGEST_PERIOD_S:
            return move.limits
        way = np.abs(np.subtract(move.path.end, self._active.joints))
        least = np.maximum(LEAST_SPEED * move.limits.velocity, LEAST_S * move.limits.acceleration)
        slow = np.maximum(way / (PERIODS * self._period_s), least)
        return move.limits._replace(velocity=np.minimum(move.limits.velocity, slow))

    def _look_ahead(self) -> None:
        """Head for the next point of a path that is pursued."""
        pursuit = self._pursuit
        if pursuit is None or (pursuit.ends and not self._not_taken_over):
            return
        self._ticks += 1
        if self._ticks < self._replan_ticks:
            return
        if self._active is self._drive:
            if self._drive.under_way:
                self._servo.start_from(*self._drive.planned_state())
            else:
                self._servo.start_from(self._drive.joints)
        try:
            self._servo.head_for(pursuit.point_ahead_of(self._active.joints), pursuit.limits)
        except ArithmeticError:
            if self._active is self._servo:
                raise
            return  # the robot goes on with the move before, and asks again in the next tick
        if self._active is self._drive:
            self._drive.abandon()
            self._active = self._servo
        self._ticks = 0
