"""The servo: goes along one course at a time, each of which may take over from the one before in mid-motion.

Smart and direct mode have it head for the newest target, joint trajectories have it follow theirs.
"""

from typing import Protocol

from iiwa_sim.motion.courses import Courses, State
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import JointLimits
from iiwa_sim.motion.rate import PlannedTime

LEAST_PART = 0.01
"""Smallest part of the speed for planning a course while the override decreases; for less, the robot stays
on its course, which slows down with the override."""


class Timed(Protocol):
    """Where joints are over time (s), from 0 on; they rest at its end."""

    @property
    def end(self) -> Joints:
        """Where they rest (rad)."""

    @property
    def end_s(self) -> float:
        """When they rest."""

    def joints(self, time_s: float) -> Joints:
        """Joint positions (rad)."""

    def state(self, time_s: float) -> State:
        """Joint positions, velocities and accelerations."""


class Servo:
    """Joint positions (rad) over ticks. Time on a course passes at the rate of the override, and a stop lets
    it come to a halt, so both leave the robot on its course.

    To a target each joint goes as fast as its limits allow, and would rest there; it does not wait for the
    others. A joint that is faster than a new velocity limit brakes first, and one that is too fast to rest at
    a new target passes it and comes back.

    It passes no position limit, which Ruckig does not know of: a joint that brakes at once comes to rest no
    farther out than it would have, or at its target; so from a good course every new one is good, unless
    the limits of acceleration or jerk become lower on the way. A course that Ruckig does not find, or that
    would pass a position limit after all, is not taken: the robot stays on the one it is on, which ends at
    rest within the limits, and asks again in the next tick.
    """

    def __init__(
        self,
        joints: Joints,
        time: PlannedTime,
        limits: JointLimits,
        position_min: Joints,
        position_max: Joints,
    ) -> None:
        """The robot rests at `joints` (rad), within `position_min` and `position_max` (rad)."""
        self.joints = joints
        self.rest = joints
        """Where the robot comes to rest at the end, or after the stop in progress (rad)."""
        self.courses = Courses(position_min, position_max)
        self.course: Timed | None = None
        """What it goes along; None at rest."""
        self._time = time
        self._limits = limits
        self._asks_again = False
        self._taken_over: tuple[Joints, Joints] | None = None  # velocity and acceleration

    @property
    def moving(self) -> bool:
        """Whether the robot moves, or is being stopped."""
        return self.course is not None or self._asks_again

    @property
    def stopping(self) -> bool:
        """Whether the robot is being stopped."""
        return self.course is not None and self._time.stopping

    @property
    def coming(self) -> Joints:
        """Where the next tick brings the robot (rad), if nothing is asked for until then."""
        return self.joints if self.course is None else self.course.joints(self._time.coming_s)

    @property
    def goal(self) -> Joints:
        """The target, or the end of a trajectory or a stop (rad); the present position at rest."""
        return self.rest

    @property
    def time_s(self) -> float:
        """Time on the course, at the rate of the override."""
        return self._time.time_s

    @property
    def state(self) -> State:
        """Where the robot is, and its derivatives by planned time."""
        if self.course is not None:
            return self.course.state(self._time.time_s)
        still = (0.0,) * len(self.joints)
        return (self.joints, *(self._taken_over or (still, still)))

    def head_for(self, target: Joints, limits: JointLimits) -> None:
        """Go to joint positions (rad) within the position limits, from now on within these limits.

        Not to be called while a stop is under way. Raises `ArithmeticError`, and changes nothing, where no
        course is found from rest.
        """
        if self.course is None and self._taken_over is None:
            self._time.begin()
        part, still = self._time.override.part_to_keep, (0.0,) * len(target)
        # While the override decreases, a course at full speed would be faster than requested.
        held = limits._replace(velocity=part * limits.velocity)
        enough = part >= LEAST_PART
        course = self.courses.find(self.state, (target, still, still), held) if enough else None
        if course is not None:
            self.course, self._taken_over = course, None
            self._time.start(0.0)
        elif self.course is None:
            raise ArithmeticError(f"Ruckig: no way from {self.joints} to {target} within {limits}")
        self._asks_again = course is None or part < 1.0
        self.rest, self._limits = target, limits

    def follow(self, course: Timed) -> None:
        """Go along a course that was planned since the last tick, from where the robot is."""
        if self.course is None:
            self._time.begin()
        self.course = course
        self._time.start(0.0)
        self.rest = course.end

    def rest_after_stop(self) -> Joints:
        """Where the robot would come to rest after a stop now (rad)."""
        return self.joints if self.course is None else self.course.joints(self._time.rest_s())

    def stop(self) -> None:
        """Stop on the course, and forget where it goes."""
        self._time.stop()
        self._asks_again = False
        self.rest = self.rest_after_stop()

    def start_from(
        self,
        joints: Joints,
        velocity: Joints | None = None,
        acceleration: Joints | None = None,
    ) -> None:
        """Start from other joint positions (rad): another motion has moved the robot, or will have.

        At rest, or with a velocity and an acceleration by planned time (rad/s, rad/s^2): then a target has to
        follow before the next tick.
        """
        self.joints = self.rest = joints
        self.course, self._asks_again, self._taken_over = None, False, None
        if velocity is not None and acceleration is not None:
            self._taken_over = velocity, acceleration

    def step(self) -> None:
        """Make one tick.

        If no course is found even from rest, the robot rests there, and `ArithmeticError` is raised.
        """
        if self._asks_again and (self.course is None or self._time.override.part_to_keep == 1.0):
            self._ask_again()
        if self.course is None:
            return
        self._time.step()
        self.joints = self.course.joints(self._time.time_s)
        if self._time.stopped or self._time.time_s >= self.course.end_s:
            self.course = None

    def _ask_again(self) -> None:
        try:
            self.head_for(self.rest, self._limits)
        except ArithmeticError:
            self._asks_again = False
            self.rest = self.joints
            raise
