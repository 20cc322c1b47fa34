"""Joint trajectories of one robot: checked, taken, compared with where the robot is, and ended.

Meanings, defaults and errors are those of ros2_controllers' joint_trajectory_controller, so its clients drive
this robot, too: https://control.ros.org, joint_trajectory_controller.
"""

from collections.abc import Callable, Mapping, Sequence
from enum import Enum
from itertools import pairwise
from math import inf, isfinite
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from iiwa_sim.controller.endings import Ending, PendingMove
from iiwa_sim.controller.errors import EXECUTION, REPLACED, STOP_TRIGGERED, SUCCESS, Refused
from iiwa_sim.controller.lin_planner import ROUNDING_RAD
from iiwa_sim.controller.modes import TRANSITIONS, Event, Mode
from iiwa_sim.controller.moves import Moves
from iiwa_sim.controller.planner import outside
from iiwa_sim.motion.joint_trajectory import Beyond, Knot, Reference
from iiwa_sim.motion.joints import Joints

if TYPE_CHECKING:
    from iiwa_sim.controller.controller import Controller

MOST_POINTS = 2000
"""A trajectory of more is refused: taking one of so many costs 20 ms, in which ticks are late."""
LONGEST_S = 86400.0
"""A trajectory that takes longer is refused: its times are a mistake."""
SHORTEST_S = 1e-4
"""Length of a trajectory of one point that is for now."""
END_VELOCITY_RAD_S = 1.19e-7
"""Largest velocity of the last point: what joint_trajectory_controller takes for 0."""
STOPPED_RAD_S = 0.01
"""A joint that is slower has stopped, where the goal does not say otherwise."""
ROUNDING = 1e-6
"""Part of a limit of velocity by which a curve may pass it: rounding of who computed it."""
START_RAD = 0.087
"""A trajectory that begins farther from the robot on any joint is refused: as far as a direct move goes."""
PREEMPTED = "preempted by a newer trajectory"


class TrajectoryPoint(NamedTuple):
    """Point of a trajectory, in the order of the joints' names."""

    time_s: float
    """Since the beginning of the trajectory."""
    positions: Sequence[float]
    """rad"""
    velocities: Sequence[float] = ()
    """rad/s; none where they are not told."""
    accelerations: Sequence[float] = ()
    """rad/s^2; none where they are not told."""


class Tolerance(NamedTuple):
    """How far a joint may be from where it shall be: 0 for the default, -1 for any distance."""

    position: float = 0.0
    """rad"""
    velocity: float = 0.0
    """rad/s"""


class TrajectoryRequest(NamedTuple):
    """A trajectory that is asked for."""

    joints: Sequence[str]
    """Names, each of the robot's once, in any order."""
    points: Sequence[TrajectoryPoint]
    delay_s: float = 0.0
    """How far in the future the trajectory begins, below 0 in the past: points that are over are left out
    then."""
    path_tolerance: Mapping[str, Tolerance] = {}
    """Along the way, by joints' names. By default nothing is compared."""
    goal_tolerance: Mapping[str, Tolerance] = {}
    """Tolerances at the end. By default joints have to be slower than `STOPPED_RAD_S`."""
    goal_time_s: float = 0.0
    """How long after its end the goal tolerances have to be kept; 0 for any time."""
    may_end_fast: bool = False
    """True if the last point may have a velocity: for streams of trajectories, each of which replaces
    another."""


class Tolerances(NamedTuple):
    """Tolerances of all joints in the robot's order; inf where nothing is compared."""

    position: Joints
    """rad"""
    velocity: Joints
    """rad/s"""


class Outcome(Enum):
    """How a trajectory ended."""

    REACHED = "reached"
    PATH_TOLERANCE = "path tolerance"
    GOAL_TOLERANCE = "goal tolerance"
    CANCELLED = "cancelled"
    ENDED = "ended"
    """Ended by a stop, another motion, another trajectory or a fault."""


class TrajectoryEnd(NamedTuple):
    """The end of a trajectory."""

    outcome: Outcome
    reason: str
    """Nothing for one that was reached."""


TrajectoryEnded = Callable[[TrajectoryEnd], None]


class Progress(NamedTuple):
    """Progress of a trajectory in a tick. Joints are in the robot's order: rad, rad/s, rad/s^2."""

    number: int
    time_s: float
    """Since its beginning, at the rate of the override."""
    desired: tuple[Joints, Joints, Joints]
    """Positions, velocities and accelerations of the trajectory."""
    actual: tuple[Joints, Joints]
    """Positions and velocities of the robot."""


class _Active(NamedTuple):
    """The trajectory that is followed or waits for the robot to rest."""

    number: int
    path: Tolerances
    goal: Tolerances
    goal_time_s: float
    end_s: float

    @property
    def compares_path(self) -> bool:
        """True if it says how near the robot has to be along the way."""
        return min(*self.path.position, *self.path.velocity) < inf


class JointTrajectories:
    """Takes joint trajectories for one robot, watches the one that is followed, and tells how each ended."""

    def __init__(self, controller: "Controller", moves: Moves) -> None:
        self._controller = controller
        self._moves = moves
        controller.watch_trajectory = self._watch
        description = controller.model.description
        self._names = description.joints
        self._lowest = np.array(description.position_min) - ROUNDING_RAD
        self._highest = np.array(description.position_max) + ROUNDING_RAD
        self._velocity = np.array(description.velocity)
        self._limits = controller.targets.limits[Mode.DIRECT]
        self._active: _Active | None = None
        self._outcome = Outcome.ENDED  # of the active one, if it does not come to its goal

    def follow(self, request: TrajectoryRequest, when_ended: TrajectoryEnded | None) -> tuple[int, str]:
        """Take a trajectory in place of what runs; gives its number, and a remark on how it was understood.

        It begins at once where the robot rests or follows another one, else when the robot has come to rest.
        Raises `Refused`, and then nothing has changed.
        """
        controller = self._controller
        controller.errors.check()
        self._moves.check_hold()
        knots = knots_of(request, self._names)
        path, note = tolerances_of(request.path_tolerance, self._names)
        goal, goal_note = tolerances_of(request.goal_tolerance, self._names, STOPPED_RAD_S)
        change = TRANSITIONS[controller.mode, Event.TRAJECTORY]
        followed = None if change.stops else controller.motions.tracked
        here = controller.motions.rest_after_stop()
        still = (0.0,) * len(here)
        position, velocity, acceleration = here, still, still
        if followed is not None:
            position, velocity, acceleration = followed.reference.at(controller.motions.tracked_s)
        reference = Reference(_from_here(knots, position, velocity, acceleration))
        self._check(reference, position)
        try:
            trajectory = controller.motions.plan_trajectory(reference, self._limits)
        except ArithmeticError:
            raise Refused(EXECUTION, "no way from the present motion onto the trajectory") from None
        with controller.endings.because(
            STOP_TRIGGERED, PREEMPTED if controller.mode is Mode.TRAJECTORY else REPLACED
        ):
            number = self._moves.accept(Event.TRAJECTORY)
            controller.motions.track(number, trajectory)
        active = _Active(number, path, goal, request.goal_time_s, reference.end_s)

        def ended(ending: Ending) -> None:
            if self._active is active:
                self._active = None
            if when_ended is not None:
                outcome = Outcome.REACHED if ending.code == SUCCESS else self._outcome
                when_ended(TrajectoryEnd(outcome, ending.reason))

        controller.endings.pending.append(PendingMove(number, ended, None))
        self._active, self._outcome = active, Outcome.ENDED
        return number, "; ".join(filter(None, (note, goal_note)))

    def cancel_trajectory(self, number: int) -> bool:
        """Stop on the trajectory of this number; return whether it was followed or waited."""
        if not self._controller.is_pending(number):
            return False
        if self._active is not None and self._active.number == number:
            self._end(Outcome.CANCELLED, "cancelled")
        return True

    @property
    def progress(self) -> Progress | None:
        """How far the trajectory that is followed has come; None while there is none."""
        motions, active = self._controller.motions, self._active
        followed = motions.tracked
        if followed is None or active is None:
            return None
        time_s, actual = motions.tracked_s, (motions.joints, self._controller.joint_velocity())
        return Progress(active.number, time_s, followed.reference.at(time_s), actual)

    def _check(self, reference: Reference, here: Joints) -> None:
        """Raises `Refused` where the reference passes limits of positions or velocities, or begins
        elsewhere."""
        beyond = reference.first_beyond(0, self._lowest, self._highest)
        if beyond is not None:
            position = reference.at(beyond.time_s)[0][beyond.joint]
            low, high = self._lowest[beyond.joint], self._highest[beyond.joint]
            raise outside(self._at(beyond), position, low, high)
        fastest = (1.0 + ROUNDING) * self._velocity
        beyond = reference.first_beyond(1, -fastest, fastest)
        if beyond is not None:
            limit = self._velocity[beyond.joint]
            raise Refused(EXECUTION, f"{self._at(beyond)} is faster than its limit of {limit:.7g} rad/s")
        away = np.abs(np.subtract(reference.at(0.0)[0], here))
        farthest = int(away.argmax())
        if away[farthest] > START_RAD:
            where = f"{self._names[farthest]} is {away[farthest]:.7g} rad from where the trajectory begins"
            raise Refused(EXECUTION, f"{where}: expected {START_RAD:g} rad at most")

    def _at(self, beyond: Beyond) -> str:
        return f"after {beyond.time_s:.3f} s {self._names[beyond.joint]}"

    def _watch(self) -> None:
        """Look after a tick whether the robot is where the trajectory asks for, where it says how near."""
        active, motions = self._active, self._controller.motions
        if active is None:
            return
        compares = active.compares_path if motions.tracked_s < active.end_s else active.goal_time_s > 0.0
        progress = self.progress if compares else None  # not in most ticks, as it costs more than they do
        if progress is None:
            return
        if progress.time_s < active.end_s:
            fault = self._beyond(progress, active.path)
            if fault:
                self._end(Outcome.PATH_TOLERANCE, f"path tolerance: {fault} after {progress.time_s:.3f} s")
        elif progress.time_s - active.end_s > active.goal_time_s:
            fault = self._beyond(progress, active.goal)
            if fault:
                late = f"{progress.time_s - active.end_s:.3f} s after the end"
                self._end(Outcome.GOAL_TOLERANCE, f"goal tolerance: {fault}, {late}")

    def _beyond(self, progress: Progress, tolerances: Tolerances) -> str:
        """Which joint is beyond its tolerance, in words; nothing if none is."""
        units = "rad", "rad/s"
        for unit, wanted, there, most in zip(
            units, progress.desired, progress.actual, tolerances, strict=False
        ):
            for name, a, b, bound in zip(self._names, wanted, there, most, strict=True):
                if abs(a - b) > bound:
                    return f"{name} is {abs(a - b):.7g} {unit} off, more than {bound:g}"
        return ""

    def _end(self, outcome: Outcome, reason: str) -> None:
        self._outcome = outcome
        with self._controller.endings.because(STOP_TRIGGERED, reason):
            self._controller.motions.end_trajectory()


def knots_of(request: TrajectoryRequest, names: Sequence[str]) -> list[Knot]:
    """The points in the order of the robot's joints, at their times from now on. Raises `Refused`."""
    order = order_of(request.joints, names)
    count = len(request.points)
    if not count:
        raise Refused(EXECUTION, "a trajectory without points")
    if count > MOST_POINTS:
        raise Refused(EXECUTION, f"{count} points: expected up to {MOST_POINTS}")
    if not isfinite(request.delay_s) or abs(request.delay_s) > LONGEST_S:
        raise Refused(EXECUTION, "the stamp of the header is not within a day from now")
    if not (isfinite(request.goal_time_s) and request.goal_time_s >= 0.0):
        raise Refused(EXECUTION, "goal_time_tolerance: expected 0 or more")
    knots = [_knot(k, point, request.delay_s, order) for k, point in enumerate(request.points)]
    _check_times(request)
    last = request.points[-1]
    if not request.may_end_fast and any(last.velocities):
        if max(map(abs, last.velocities)) > END_VELOCITY_RAD_S:
            raise Refused(EXECUTION, f"point {count - 1}, the last one, has a velocity other than 0")
        knots[-1] = knots[-1]._replace(velocities=(0.0,) * len(order))
    if knots[-1].time_s < 0.0:
        raise Refused(EXECUTION, f"the trajectory ended {-knots[-1].time_s:.3f} s ago")
    return knots


def tolerances_of(
    tolerances: Mapping[str, Tolerance], names: Sequence[str], stopped_rad_s: float = inf
) -> tuple[Tolerances, str]:
    """Tolerances joint by joint, and a remark where they make no sense: then all of them are the defaults."""
    unknown = next((name for name in tolerances if name not in names), None)
    odd = next((name for name, each in tolerances.items() if not all(map(_is_tolerance, each))), None)
    remark = ""
    if unknown is not None:
        tolerances, remark = {}, f"tolerances are the defaults: there is no joint {unknown}"
    elif odd is not None:
        tolerances, remark = {}, f"tolerances are the defaults: those of {odd} are below 0, or no numbers"
    told = [tolerances.get(name, Tolerance()) for name in names]
    position = tuple(_bound(each.position, inf) for each in told)
    return Tolerances(position, tuple(_bound(each.velocity, stopped_rad_s) for each in told)), remark


def order_of(joints: Sequence[str], names: Sequence[str]) -> list[int]:
    """Return the places of the robot's joints, `names`, in a message. Raises `Refused`."""
    if not joints:
        raise Refused(EXECUTION, "joint_names is empty")
    for name in joints:
        if name not in names:
            raise Refused(EXECUTION, f"there is no joint {name[:40]!r}: expected {', '.join(names)}")
    if len(joints) != len(names) or len(set(joints)) != len(names):
        raise Refused(EXECUTION, f"joint_names: expected each of {', '.join(names)} once")
    return [list(joints).index(name) for name in names]


def _knot(k: int, point: TrajectoryPoint, delay_s: float, order: Sequence[int]) -> Knot:
    if not isfinite(point.time_s):
        raise Refused(EXECUTION, f"point {k}: a time that is not finite")
    positions = _values(k, "positions", point.positions, order)
    if positions is None:
        raise Refused(EXECUTION, f"point {k} has no positions")
    velocities = _values(k, "velocities", point.velocities, order)
    accelerations = _values(k, "accelerations", point.accelerations, order)
    return Knot(point.time_s + delay_s, positions, velocities, accelerations)


def _values(k: int, what: str, values: Sequence[float], order: Sequence[int]) -> Joints | None:
    if not values:
        return None
    if len(values) != len(order):
        raise Refused(EXECUTION, f"point {k} has {len(values)} {what}: expected {len(order)}")
    if not all(map(isfinite, values)):
        raise Refused(EXECUTION, f"point {k}: {what} that are not finite")
    return tuple(float(values[place]) for place in order)


def _check_times(request: TrajectoryRequest) -> None:
    times = [point.time_s for point in request.points]
    if times[0] < 0.0:
        raise Refused(EXECUTION, f"point 0 at {times[0]:g} s: expected 0 or later")
    if times[-1] > LONGEST_S:
        raise Refused(EXECUTION, f"the trajectory takes more than {LONGEST_S:g} s")
    for k, (before, time) in enumerate(pairwise(times)):
        if not time > before:
            raise Refused(
                EXECUTION, f"point {k + 1} at {time:g} s is not later than the one before, at {before:g} s"
            )


def _is_tolerance(value: float) -> bool:
    return isfinite(value) and (value >= 0.0 or value == -1.0)


def _bound(value: float, default: float) -> float:
    if value == 0.0:
        return default
    return inf if value < 0.0 else value


def _from_here(knots: list[Knot], position: Joints, velocity: Joints, acceleration: Joints) -> list[Knot]:
    """Knots from now on: with where the curve sets out in front, or without what is over."""
    if knots[0].time_s > 0.0:
        return [Knot(0.0, position, velocity, acceleration), *knots]
    first = next((k for k, knot in enumerate(knots) if knot.time_s > 0.0), None)
    if first is None:  # one point, for now: a way of no length
        place = knots[-1].positions
        return [Knot(0.0, place), Knot(SHORTEST_S, place)]
    return knots[first - 1 :]
