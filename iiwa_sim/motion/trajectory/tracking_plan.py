"""How the robot follows a joint trajectory, from wherever it is."""

from typing import NamedTuple

from iiwa_sim.motion.courses import Courses, RuckigCourse, State
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.trajectory.reference import Reference
from iiwa_sim.motion.trajectory.smoothed import Smoothed
from iiwa_sim.motion.trajectory.windows import windows_of

FIRST_JOIN_S = 0.01
"""A robot that is beside the curve, or moves otherwise, is on it after so long at the soonest."""
JOIN_GROWTH = 1.5
"""Where it cannot be, so many times later is tried next."""


class TrackingPlan(NamedTuple):
    """How a trajectory is followed: along the reference as smoothed by `windows_of`.

    Where the robot begins beside that, or with another velocity, it first joins it by the course of Ruckig
    that is there soonest. Positions, velocities, accelerations and jerks keep their limits at every time:
    those of the averages by what an average is, those of a join by Ruckig, whose turning points are looked
    at. At the end the robot holds the last point.
    """

    reference: Reference
    smoothed: Smoothed
    join: RuckigCourse | None
    """Course from where the robot is onto the smoothed curve; None where it is there already."""
    join_s: float
    """When it is there."""
    end_s: float
    """When the robot rests at the end: at `join_s` where the join leads there at once."""

    @property
    def end(self) -> Joints:
        """The last point (rad)."""
        return self.reference.end

    def joints(self, time_s: float) -> Joints:
        """Joint positions (rad) at a time."""
        if self.join is None or time_s >= self.join_s:
            return self.smoothed.joints(time_s) if time_s < self.end_s else self.end
        return self.join.joints(time_s)

    def state(self, time_s: float) -> State:
        """Joint positions, velocities and accelerations at a time."""
        return (self.smoothed if self.join is None or time_s >= self.join_s else self.join).state(time_s)


class Followed(NamedTuple):
    """A way, and where on it the robot is."""

    way: TrackingPlan
    time_s: float
    """Since the trajectory has begun, at the rate of the override."""

    @property
    def desired(self) -> State:
        """What the reference asks for now."""
        return self.way.reference.at(self.time_s)


def tracking_plan(reference: Reference, state: State, limits: JointLimits, courses: Courses) -> TrackingPlan:
    """How to follow a reference within limits from a state of motion.

    Raises `ArithmeticError` where no way onto it is found.
    """
    still = (0.0,) * len(reference.end)
    joins = state != (reference.start, still, still) or reference.times[0] != 0.0
    windows = windows_of(reference, limits, from_rest=not joins)
    smoothed = Smoothed(reference, windows)
    if not joins:
        return TrackingPlan(reference, smoothed, None, 0.0, smoothed.end_s)
    straight = courses.find(state, (reference.end, still, still), limits)
    if straight is not None and straight.end_s >= reference.end_s:
        return TrackingPlan(reference, smoothed, straight, straight.end_s, straight.end_s)
    join_s = max(windows.width_s, FIRST_JOIN_S)
    while join_s < smoothed.end_s:
        course = courses.find(state, smoothed.state(join_s), limits, join_s)
        if course is not None:
            return TrackingPlan(reference, smoothed, course, join_s, smoothed.end_s)
        join_s *= JOIN_GROWTH
    if straight is None:
        raise ArithmeticError("Ruckig: no way onto the trajectory")
    return TrackingPlan(reference, smoothed, straight, straight.end_s, straight.end_s)
