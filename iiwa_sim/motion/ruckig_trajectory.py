"""Trajectories of Ruckig: from one state of motion to another, each joint as fast as its limits allow."""

from collections.abc import Iterator
from math import sqrt
from typing import Any, NamedTuple

from ruckig import InputParameter, Result, Ruckig, RuckigError, Synchronization, Trajectory

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits

JERK_SHARES = (1.0, 1.0 - 1e-6)
"""Factors of the jerk to try: Ruckig fails on phases of length zero, which slightly less jerk avoids."""
SPEED_KEPT = 1.0 - 1e-11
"""Part of its speed with which a joint begins a new trajectory.
At the velocity limit, an excess by rounding would make Ruckig's trajectory seconds longer."""
EXACT_RAD = 1e-10
"""Ruckig accepts trajectories that end 1e-8 rad beside the target; the step that remains would be a jerk."""
LATE_S = 1e-10
"""A trajectory that takes so much longer than requested counts as on time: rounding."""
ROUNDING_RAD = 1e-9
"""Rounding of a position at a limit."""
ROUNDING_S = 1e-9
"""Rounding of the time at which a joint reverses at the end of a phase."""

State = tuple[Joints, Joints, Joints]
"""Positions (rad), velocities (rad/s) and accelerations (rad/s^2)."""


class RuckigTrajectory(NamedTuple):
    """Joint positions over time (s) from 0 on, with a state of motion at its end."""

    trajectory: Trajectory
    end: Joints

    @property
    def end_s(self) -> float:
        """Duration (s)."""
        return float(self.trajectory.duration)

    def joints(self, time_s: float) -> Joints:
        """Return joint positions (rad); after the end, those at the end."""
        return self.end if time_s >= self.end_s else tuple(self.trajectory.at_time(time_s)[0])

    def state(self, time_s: float) -> State:
        """Return joint positions, velocities and accelerations."""
        position, velocity, acceleration = self.trajectory.at_time(time_s)
        return tuple(position), tuple(velocity), tuple(acceleration)


class RuckigPlanner:
    """Planner of Ruckig trajectories within position limits, which Ruckig does not know."""

    def __init__(self, position_min: Joints, position_max: Joints) -> None:
        """Set the limits of positions (rad)."""
        self._position_min, self._position_max = position_min, position_max
        self._ruckig = Ruckig(len(position_min))

    def find(
        self, start: State, end: State, limits: JointLimits, duration_s: float | None = None
    ) -> RuckigTrajectory | None:
        """Return a trajectory from one state to another; None if Ruckig finds none that is good.

        The joints arrive together after `duration_s`. Without it each joint arrives as soon as possible.
        """
        task = InputParameter(len(self._position_min))
        task.current_position, task.target_position = list(start[0]), list(end[0])
        task.current_velocity = [SPEED_KEPT * v for v in start[1]]
        task.target_velocity = [SPEED_KEPT * v for v in end[1]]
        task.current_acceleration, task.target_acceleration = list(start[2]), list(end[2])
        task.max_velocity, task.max_acceleration, jerk = (limit.tolist() for limit in limits)
        task.synchronization = Synchronization.No if duration_s is None else Synchronization.Time
        task.minimum_duration = duration_s
        for share in JERK_SHARES:
            task.max_jerk = [share * j for j in jerk]
            found = Trajectory(len(self._position_min))
            try:
                result = self._ruckig.calculate(task, found)
            except (RuckigError, ValueError):  # ValueError for results that its bindings do not know
                continue
            in_time = duration_s is None or found.duration <= duration_s + LATE_S
            if result == Result.Working and in_time and self._is_good(found, end[0]):
                return RuckigTrajectory(found, end[0])
        return None

    def _is_good(self, trajectory: Trajectory, target: Joints) -> bool:
        """Return True if a trajectory ends at its target (rad), and passes no position limit."""
        ends = trajectory.at_time(trajectory.duration)[0]
        return all(
            abs(end - goal) <= EXACT_RAD
            and all(low - ROUNDING_RAD <= place <= high + ROUNDING_RAD for place in (end, *turns(profile)))
            for end, goal, profile, low, high in zip(
                ends, target, trajectory.profiles[0], self._position_min, self._position_max, strict=True
            )
        )


def turns(profile: Any) -> Iterator[float]:
    """Yield positions (rad) at which a joint reverses on Ruckig's profile; Ruckig's extrema miss some."""
    brake = profile.brake
    for part in (brake, profile) if brake.duration else (profile,):
        for duration, p, v, a, j in zip(part.t, part.p, part.v, part.a, part.j, strict=False):
            square = a * a - 2.0 * j * v
            if duration == 0.0 or square < 0.0:
                continue
            if j:
                root = sqrt(square)
                rests = [(-a - root) / j, (root - a) / j]
            else:
                rests = [-v / a] if a else []
            for t in rests:
                if ROUNDING_S < t < duration + ROUNDING_S:
                    yield p + t * (v + t * (a / 2.0 + t * j / 6.0))
