"""Pursuit: what a robot in motion heads for, to come onto a path and stay close to it to its end."""

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.queue.move import Move

AHEAD = 1.5
"""The point headed for is so many braking times ahead, so that the robot does not brake before the end."""
STEPS = 16
"""In so many steps that point is looked for, over the way there."""


class Pursuit:
    """Points of a move's path, each a little ahead of where the robot is."""

    def __init__(self, move: Move, limits: JointLimits) -> None:
        """Of a move that is carried out within these limits."""
        self.move = move
        self.limits = limits
        velocity, acceleration, jerk = limits
        braking_s = float((velocity / acceleration + acceleration / jerk).max()) / 2.0
        self._ahead_s = AHEAD * braking_s
        self._velocity: list[float] = velocity.tolist()
        self._step = self._ahead_s / (STEPS * move.length_s) if move.length_s else 1.0
        self._s = 0.0

    @property
    def ends(self) -> bool:
        """Whether the point last given is the end of the path."""
        return self._s >= 1.0

    def point_ahead_of(self, joints: Joints) -> Joints:
        """Joint positions (rad) on the path, ahead of where the robot is (rad); they never go back."""
        point = self.move.path.joints(self._s)
        while self._s < 1.0 and self._way_s(joints, point) < self._ahead_s:
            self._s = min(self._s + self._step, 1.0)
            point = self.move.path.joints(self._s)
        return self.move.path.end if self._s >= 1.0 else point

    def _way_s(self, joints: Joints, point: Joints) -> float:
        """How long the slowest joint takes to a point at its velocity limit."""
        return max(map(_time_s, point, joints, self._velocity))


def _time_s(there: float, here: float, velocity: float) -> float:
    return abs(there - here) / velocity
