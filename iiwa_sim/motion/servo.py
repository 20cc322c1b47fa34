"""The servo: heads for the newest target in mid-motion; and the pursuit of moves that replace each other."""

from math import inf

import numpy as np

from iiwa_sim.motion.blend import Move
from iiwa_sim.motion.courses import Courses
from iiwa_sim.motion.executor import Executor
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits

REPLAN_S = 0.008
"""Time after which a pursuit heads for another point of its path."""
AHEAD = 1.5
"""The point headed for is so many braking times ahead, so that the robot does not brake before the end."""
STEPS = 16
"""Steps in which that point is looked for, over the distance to it."""

LONGEST_PERIOD_S = 0.12
"""Moves that come so soon one after the other are a stream."""
PERIODS = 2.0
"""A move of a stream takes so many of its periods at the least: then the next one comes before it brakes, and
the robot goes on evenly, a period behind its commands. With fewer it would stop and go."""
LEAST_SPEED = 1e-3
"""A joint with hardly any distance keeps this part of its velocity limit for corrections; and at least what
it reaches at its acceleration limit in ..."""
LEAST_S = 3e-4
"""... this time: after it has passed its path it has to come back."""


class Servo:
    """Heads for targets, each of which takes over from the motion before.

    To a target each joint goes as fast as its limits allow, and would rest there; it does not wait for the
    others. A joint that is faster than a new velocity limit brakes first, and one that is too fast to rest at
    a new target passes it and comes back.

    It passes no position limit, which Ruckig does not know of. Where Ruckig finds no course, or one that
    passes such a limit, the robot stays on its present one, which ends at rest within the limits, and the
    servo asks again in the next tick. It also waits while the override falls: a course at full speed would be
    faster than requested.
    """

    def __init__(
        self, executor: Executor, limits: JointLimits, position_min: Joints, position_max: Joints
    ) -> None:
        """The robot rests within `position_min` and `position_max` (rad)."""
        self.courses = Courses(position_min, position_max)
        self._executor = executor
        self._limits = limits
        self.asks_again = False
        """True if the robot is still on its way to an earlier target than the newest."""

    def head_for(self, target: Joints, limits: JointLimits) -> None:
        """Go to joint positions (rad) within the position limits, from now on within these limits.

        Not to be called while a stop is under way. Raises `ArithmeticError`, and changes nothing, where no
        course is found from rest, or from a motion that is not the servo's.
        """
        executor, still = self._executor, (0.0,) * len(target)
        course = None
        if not executor.time.falling:
            course = self.courses.find(executor.state, (target, still, still), limits)
        if course is not None:
            executor.follow(course)
        elif executor.trajectory is None or executor.under_way:
            raise ArithmeticError(f"Ruckig: no way from {executor.joints} to {target} within {limits}")
        self.asks_again = course is None
        executor.rest, self._limits = target, limits

    def step(self) -> None:
        """Ask again for what was not found; to be called before each tick.

        If no course is found even from rest, the robot rests there, and `ArithmeticError` is raised.
        """
        if self.asks_again:
            try:
                self.head_for(self._executor.rest, self._limits)
            except ArithmeticError:
                self.asks_again = False
                self._executor.rest = self._executor.joints
                raise


class Pursuit:
    """Moves of a compliant robot, each of which replaces the one before without a stop between.

    The servo takes over from the queue with the position, velocity and acceleration there are, and heads for
    one point of the path after the other, each a little ahead of where the robot is. Moves that come in a
    stream are so slow that each still runs when the next one comes.
    """

    def __init__(self, executor: Executor, servo: Servo) -> None:
        self.move: Move | None = None
        """The move that is pursued."""
        self._executor = executor
        self._servo = servo
        self._has_begun = False
        self._since_s = self._period_s = inf  # of planned time, since the newest move has come, and before it

    @property
    def waits(self) -> bool:
        """True if the servo has found no way yet from the motion of the queue."""
        return self.move is not None and not self._has_begun

    def begin_stream(self) -> None:
        """The move that begins next comes long after any other that it replaces."""
        self._since_s, self._period_s = 0.0, inf

    def replace(self, move: Move) -> bool:
        """Pursue a move in place of the one that runs; return False if none runs, or it is being stopped."""
        executor = self._executor
        # Of several moves between two ticks only the first counts.
        if self._since_s > 0.0:
            self._period_s, self._since_s = self._since_s, 0.0
        self.move = None
        runs = executor.trajectory is not None and not executor.stopping
        if not runs and not self._servo.asks_again:
            if not executor.stopping:
                executor.rest_at(executor.joints)  # forget a move that has not set out
            return False
        self.move, self._has_begun = move, False
        self._limits = self._limits_of(move)
        velocity, acceleration, jerk = self._limits
        braking_s = float((velocity / acceleration + acceleration / jerk).max()) / 2.0
        self._ahead_s = AHEAD * braking_s
        self._velocity: list[float] = velocity.tolist()
        self._step_s = self._ahead_s / (STEPS * move.length_s) if move.length_s else 1.0
        self._s = 0.0  # of the point last given; at 1 that is the end of the path
        self._replan_ticks = self._ticks = max(round(REPLAN_S / executor.time.tick_s), 1)
        return True

    def step(self, moving: bool) -> None:
        """Head for the next point if it is time to and the robot is `moving`; to be called before each tick.

        While the servo finds no way from the queue's motion, that goes on, and each tick asks again. Raises
        `ArithmeticError` where it finds none from its own.
        """
        executor, move = self._executor, self.move
        self._since_s += executor.time.advance_s
        if not moving:
            self.move = None
        if move is None or not moving or (self._s >= 1.0 and self._has_begun):
            return
        self._ticks += 1
        if self._ticks < self._replan_ticks:
            return
        try:
            self._servo.head_for(self._point_ahead(move), self._limits)
        except ArithmeticError:
            if self._has_begun:
                raise
            return
        self._has_begun = True
        self._ticks = 0

    def _point_ahead(self, move: Move) -> Joints:
        """Joint positions (rad) on the path, ahead of where the robot is; they never go back."""
        here = self._executor.joints
        point = move.path.joints(self._s)
        while self._s < 1.0 and max(map(_time_s, point, here, self._velocity)) < self._ahead_s:
            self._s = min(self._s + self._step_s, 1.0)
            point = move.path.joints(self._s)
        return move.path.end if self._s >= 1.0 else point

    def _limits_of(self, move: Move) -> JointLimits:
        """Limits of a move from where the robot is: in a stream so low that it still runs when the next one
        comes."""
        if self._period_s > LONGEST_PERIOD_S:
            return move.limits
        distance = np.abs(np.subtract(move.path.end, self._executor.joints))
        least = np.maximum(LEAST_SPEED * move.limits.velocity, LEAST_S * move.limits.acceleration)
        slow = np.maximum(distance / (PERIODS * self._period_s), least)
        return move.limits._replace(velocity=np.minimum(move.limits.velocity, slow))


def _time_s(there: float, here: float, velocity: float) -> float:
    return abs(there - here) / velocity
