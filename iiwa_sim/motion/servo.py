"""The servo: heads for the newest target in mid-motion, or along a move that replaces another one."""

from math import inf

import numpy as np

from iiwa_sim.motion.blend import Move
from iiwa_sim.motion.executor import Executor
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.ruckig_trajectory import RuckigPlanner

REPLAN_S = 0.008
"""Time after which the servo heads for another point of its path."""
AHEAD = 1.5
"""The point headed for is so many braking times ahead, so that the robot does not brake before the end."""
STEPS = 16
"""Steps in which that point is looked for, over the distance to it."""

LONGEST_PERIOD_S = 0.12
"""Moves that come so soon one after the other are a stream."""
PERIODS = 2.0
"""A move of a stream takes at least so many of its periods.
The next one then comes before the robot brakes, and the robot moves evenly, a period behind its commands."""
LEAST_SPEED = 1e-3
"""A joint with hardly any distance keeps this part of its velocity limit for corrections."""
LEAST_S = 3e-4
"""Such a joint also keeps the speed that it reaches in this time (s) at its acceleration limit."""


class Servo:
    """Online trajectory to the newest target, which takes over from the motion before.

    To a target each joint goes as fast as its limits allow, and would rest there; it does not wait for the
    others. A joint that is faster than a new velocity limit brakes first. A joint that is too fast to rest at
    a new target passes it and comes back.

    It passes no position limit, which Ruckig does not know. If Ruckig finds no trajectory, or one that
    passes such a limit, the robot continues as before. The servo asks again in the next tick. It also waits
    while the override falls: a trajectory at full speed would be faster than requested.

    The servo pursues a move of a compliant robot that replaces another one: it heads for one point of the
    path after the other, each a little ahead of the robot. Moves that come in a stream are so slow
    that each still runs when the next one comes.
    """

    def __init__(
        self, executor: Executor, limits: JointLimits, position_min: Joints, position_max: Joints
    ) -> None:
        """The robot rests within `position_min` and `position_max` (rad)."""
        self.planner = RuckigPlanner(position_min, position_max)
        self._executor = executor
        self._limits = limits
        self.asks_again = False
        """True if the robot still heads for an earlier target than the newest."""
        self.pursued: Move | None = None
        """The move that is pursued."""
        self._since_s = self._period_s = inf  # of planned time, since the newest move has come, and before it

    @property
    def moving(self) -> bool:
        """True if the nominal motion is not at rest, or has yet to begin."""
        return self._executor.moving or self.asks_again

    def head_for(self, target: Joints, limits: JointLimits) -> None:
        """Go to joint positions (rad) within the position limits, from now on within these limits.

        Not to be called during a stop. Raises `ArithmeticError` if no trajectory is found from
        rest; the robot then rests where it is.
        """
        executor, still = self._executor, (0.0,) * len(target)
        found = None
        if not executor.time.falling:
            found = self.planner.find(executor.state, (target, still, still), limits)
        self.asks_again = found is None and executor.trajectory is not None
        if found is not None:
            executor.follow(found)
        elif executor.trajectory is None:
            executor.rest = executor.joints
            raise ArithmeticError(f"Ruckig: no trajectory from {executor.joints} to {target} within {limits}")
        executor.rest, self._limits = target, limits

    def stop(self) -> None:
        """Forget targets and moves."""
        self.asks_again, self.pursued = False, None

    def begin_stream(self) -> None:
        """Let the next move begin a stream: it replaces no recent one."""
        self._since_s, self._period_s = 0.0, inf

    def replace(self, move: Move) -> bool:
        """Pursue a move in place of the one that runs; return False if none runs, or it is being stopped."""
        executor = self._executor
        # Only the first of several moves between two ticks counts.
        if self._since_s > 0.0:
            self._period_s, self._since_s = self._since_s, 0.0
        self.pursued = None
        if (executor.trajectory is None or executor.stopping) and not self.asks_again:
            if not executor.stopping:
                executor.rest_at(executor.joints)  # forget a move that has not set out
            return False
        self.pursued = move
        self._limits = self._limits_of(move)
        velocity, acceleration, jerk = self._limits
        braking_s = float((velocity / acceleration + acceleration / jerk).max()) / 2.0
        self._ahead_s = AHEAD * braking_s
        self._velocity: list[float] = velocity.tolist()
        self._step_s = self._ahead_s / (STEPS * move.length_s) if move.length_s else 1.0
        self._s = 0.0  # of the point last given; at 1 that is the end of the path
        self._replan_ticks = self._ticks = max(round(REPLAN_S / executor.time.tick_s), 1)
        return True

    def step(self) -> None:
        """Head for the next point of a path if it is time to, or ask again; to be called before each tick.

        Raises `ArithmeticError` if no trajectory is found even from rest.
        """
        self._since_s += self._executor.time.advance_s
        if self.pursued is not None and not self.moving:
            self.pursued = None
        move = self.pursued
        if move is not None and self._s < 1.0:
            self._ticks += 1
            if self._ticks >= self._replan_ticks:
                self.head_for(self._point_ahead(move), self._limits)
                self._ticks = 0
                return
        if self.asks_again:
            self.head_for(self._executor.rest, self._limits)

    def _point_ahead(self, move: Move) -> Joints:
        """Return joint positions (rad) on the path, ahead of where the robot is; they never go back."""
        here = self._executor.joints
        point = move.path.joints(self._s)
        while self._s < 1.0 and max(map(_time_s, point, here, self._velocity)) < self._ahead_s:
            self._s = min(self._s + self._step_s, 1.0)
            point = move.path.joints(self._s)
        return move.path.end if self._s >= 1.0 else point

    def _limits_of(self, move: Move) -> JointLimits:
        """Return limits of a move; in a stream they are so low that it still runs when the next one comes."""
        if self._period_s > LONGEST_PERIOD_S:
            return move.limits
        distance = np.abs(np.subtract(move.path.end, self._executor.joints))
        least = np.maximum(LEAST_SPEED * move.limits.velocity, LEAST_S * move.limits.acceleration)
        slow = np.maximum(distance / (PERIODS * self._period_s), least)
        return move.limits._replace(velocity=np.minimum(move.limits.velocity, slow))


def _time_s(there: float, here: float, velocity: float) -> float:
    return abs(there - here) / velocity
