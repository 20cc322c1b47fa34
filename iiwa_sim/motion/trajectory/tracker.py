"""The tracker: carries out joint trajectories, each in place of the one before."""

from typing import NamedTuple

from ruckig import Trajectory

from iiwa_sim.motion.courses import Courses, State
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.rate import PlannedTime
from iiwa_sim.motion.trajectory.reference import Reference
from iiwa_sim.motion.trajectory.smoothed import Smoothed
from iiwa_sim.motion.trajectory.windows import windows_of

FIRST_JOIN_S = 0.01
"""A robot that is beside the curve, or moves otherwise, is on it after so long at the soonest."""
JOIN_GROWTH = 1.5
"""Where it cannot be, so many times later is tried next."""


class Way(NamedTuple):
    """How a trajectory is followed."""

    reference: Reference
    smoothed: Smoothed
    join: Trajectory | None
    """From where the robot is onto the smoothed curve; None where it is there already."""
    join_s: float
    """When it is there."""
    end_s: float
    """When the robot rests at the end: at `join_s` where the join leads there at once."""


class Tracker:
    """Joint positions (rad) over ticks.

    A trajectory begins where the robot rests, or takes over from the one before in mid-motion. The robot
    follows the reference as smoothed by `windows_of`; where it begins beside that, or with another velocity,
    it first joins it by the way of `Ruckig` that is there soonest. Positions, velocities, accelerations and
    jerks keep their limits at every time: those of the averages by what an average is, those of a join by
    Ruckig, whose turning points are looked at. Time passes at the rate of the override, and a stop lets it
    come to a halt, so both leave the robot on its way. At the end the robot holds the last point.
    """

    def __init__(
        self,
        joints: Joints,
        time: PlannedTime,
        limits: JointLimits,
        position_min: Joints,
        position_max: Joints,
    ) -> None:
        """At rest at `joints` (rad), with the position limits `position_min` and `position_max` (rad)."""
        self.joints = joints
        self.rest = joints
        """Where the robot comes to rest at the end, or after the stop in progress (rad)."""
        self._time = time
        self._limits = limits
        self._courses = Courses(position_min, position_max)
        self._way: Way | None = None

    @property
    def moving(self) -> bool:
        """Whether the robot follows a trajectory, or is being stopped."""
        return self._way is not None

    @property
    def stopping(self) -> bool:
        """Whether a stop is under way."""
        return self._way is not None and self._time.stopping

    @property
    def coming(self) -> Joints:
        """Where the next tick brings the robot (rad), if nothing is asked for until then."""
        return self.joints if self._way is None else self._at(self._way, self._time.coming_s)

    @property
    def goal(self) -> Joints:
        """The last point, or the end of a stop (rad); the present position at rest."""
        return self.rest

    @property
    def time_s(self) -> float:
        """Time since the trajectory has begun, at the rate of the override."""
        return self._time.time_s

    @property
    def desired(self) -> State:
        """What the reference asks for now; at rest, standing where the robot is."""
        if self._way is None:
            still = (0.0,) * len(self.joints)
            return self.joints, still, still
        return self._way.reference.at(self._time.time_s)

    def plan(self, reference: Reference, begin: Joints | None) -> Way:
        """How to follow a reference from rest at `begin` (rad), or from the present motion for None.

        Raises `ArithmeticError` where no way onto it is found.
        """
        still = (0.0,) * len(self.joints)
        state = self._state() if begin is None else (begin, still, still)
        joins = state != (reference.start, still, still) or reference.times[0] != 0.0
        windows = windows_of(reference, self._limits, from_rest=not joins)
        smoothed = Smoothed(reference, windows)
        if not joins:
            return Way(reference, smoothed, None, 0.0, smoothed.end_s)
        straight = self._courses.find(state, (reference.end, still, still), self._limits)
        if straight is not None and straight.duration >= reference.end_s:
            return Way(reference, smoothed, straight, straight.duration, straight.duration)
        join_s = max(windows.width_s, FIRST_JOIN_S)
        while join_s < smoothed.end_s:
            course = self._courses.find(state, smoothed.state(join_s), self._limits, join_s)
            if course is not None:
                return Way(reference, smoothed, course, join_s, smoothed.end_s)
            join_s *= JOIN_GROWTH
        if straight is None:
            raise ArithmeticError("Ruckig: no way onto the trajectory")
        return Way(reference, smoothed, straight, straight.duration, straight.duration)

    def follow(self, way: Way) -> None:
        """Go that way, which was planned since the last tick, or for where the robot rests."""
        if self._way is None:
            self._time.begin()
        self._way = way
        self._time.start(0.0)
        self.rest = way.reference.end

    def rest_after_stop(self) -> Joints:
        """Where the robot would come to rest after a stop now (rad)."""
        return self.joints if self._way is None else self._at(self._way, self._time.rest_s())

    def stop(self) -> None:
        """Stop on the way, and forget where it goes."""
        self._time.stop()
        self.rest = self.rest_after_stop()

    def start_from(self, joints: Joints) -> None:
        """Start from other joint positions (rad), at rest: another motion has moved the robot."""
        self.joints = self.rest = joints
        self._way = None

    def step(self) -> None:
        """Make one tick."""
        if self._way is None:
            return
        self._time.step()
        self.joints = self._at(self._way, self._time.time_s)
        if self._time.stopped or self._time.time_s >= self._way.end_s:
            self._way = None

    def _state(self) -> State:
        """Where the robot is on its way, and its derivatives by planned time."""
        way = self._way
        if way is None:
            return self.desired
        time_s = self._time.time_s
        if way.join is None or time_s >= way.join_s:
            return way.smoothed.state(time_s)
        position, velocity, acceleration = way.join.at_time(time_s)
        return tuple(position), tuple(velocity), tuple(acceleration)

    @staticmethod
    def _at(way: Way, time_s: float) -> Joints:
        """Joint positions (rad) on a way."""
        if way.join is None or time_s >= way.join_s:
            return way.smoothed.joints(time_s) if time_s < way.end_s else way.reference.end
        return tuple(way.join.at_time(time_s)[0])
