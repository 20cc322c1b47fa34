"""Pursuit: a move that replaces another in mid-motion, without a stop between."""

from math import inf

import numpy as np

from iiwa_sim.motion.drive import Drive
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.queue.move import Move
from iiwa_sim.motion.servo import Servo

REPLAN_S = 0.008
"""Time after which a robot sent elsewhere in mid-motion is headed for another point of its path."""
AHEAD = 1.5
"""The point headed for is so many braking times ahead, so that the robot does not brake before the end."""
STEPS = 16
"""Steps in which that point is looked for, over the way there."""

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


class Pursuit:
    """Brings a robot in motion onto the path of a move, and along that to its end.

    The servo takes over from the drive with the position, velocity and acceleration there are, and is headed
    for one point of the path after the other, each a little ahead of where the robot is.
    """

    def __init__(self, move: Move, limits: JointLimits, drive: Drive, servo: Servo, tick_s: float) -> None:
        """Pursue a move within these limits, in place of what drive or servo does."""
        self.move = move
        self._limits = limits
        self._drive = drive
        self._servo = servo
        velocity, acceleration, jerk = limits
        braking_s = float((velocity / acceleration + acceleration / jerk).max()) / 2.0
        self._ahead_s = AHEAD * braking_s
        self._velocity: list[float] = velocity.tolist()
        self._step_s = self._ahead_s / (STEPS * move.length_s) if move.length_s else 1.0
        self._s = 0.0  # of the point last given; at 1 that is the end of the path
        self._replan_ticks = max(round(REPLAN_S / tick_s), 1)
        self._ticks = self._replan_ticks  # since a point was headed for

    def step(self, active: Drive | Servo) -> Drive | Servo:
        """Head for the next point, where it is time to; gives which of the two moves the robot in this tick.

        While the servo finds no way from the drive's motion, that goes on, and each tick asks again. Raises
        `ArithmeticError` where it finds none from its own.
        """
        if self._s >= 1.0 and active is self._servo:
            return active
        self._ticks += 1
        if self._ticks < self._replan_ticks:
            return active
        if active is self._drive:
            if self._drive.under_way:
                self._servo.start_from(*self._drive.planned_state())
            else:
                self._servo.start_from(self._drive.joints)
        try:
            self._servo.head_for(self._point_ahead_of(active.joints), self._limits)
        except ArithmeticError:
            if active is self._servo:
                raise
            return active
        if active is self._drive:
            self._drive.abandon()
        self._ticks = 0
        return self._servo

    def _point_ahead_of(self, joints: Joints) -> Joints:
        """Joint positions (rad) on the path, ahead of where the robot is (rad); they never go back."""
        point = self.move.path.joints(self._s)
        while self._s < 1.0 and self._way_s(joints, point) < self._ahead_s:
            self._s = min(self._s + self._step_s, 1.0)
            point = self.move.path.joints(self._s)
        return self.move.path.end if self._s >= 1.0 else point

    def _way_s(self, joints: Joints, point: Joints) -> float:
        """How long the slowest joint takes to a point at its velocity limit."""
        return max(map(_time_s, point, joints, self._velocity))


class Stream:
    """How soon moves that replace each other come, and how fast each of them is to be."""

    def __init__(self) -> None:
        """None has come yet."""
        self._since_s = inf  # of planned time, since the newest has come
        self._period_s = inf  # between that and the one before

    def advance(self, planned_s: float) -> None:
        """Go on by so much planned time."""
        self._since_s += planned_s

    def heard(self) -> None:
        """A move has come. Of several between two ticks only the first counts."""
        if self._since_s > 0.0:
            self._period_s, self._since_s = self._since_s, 0.0

    def limits_of(self, move: Move, joints: Joints) -> JointLimits:
        """Limits of a move from joint positions (rad): in a stream so low that it still runs when the next
        one comes."""
        if self._period_s > LONGEST_PERIOD_S:
            return move.limits
        way = np.abs(np.subtract(move.path.end, joints))
        least = np.maximum(LEAST_SPEED * move.limits.velocity, LEAST_S * move.limits.acceleration)
        slow = np.maximum(way / (PERIODS * self._period_s), least)
        return move.limits._replace(velocity=np.minimum(move.limits.velocity, slow))


def _time_s(there: float, here: float, velocity: float) -> float:
    return abs(there - here) / velocity
