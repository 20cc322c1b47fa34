"""What a joint trajectory is asked for with, whichever side it comes from, and what is checked of it alone.

Meanings, defaults and refusals are those of ros2_controllers' joint_trajectory_controller, so that what
drives a robot there drives this one: https://control.ros.org, joint_trajectory_controller.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import inf, isfinite
from typing import NamedTuple

from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.motion.joint_trajectory import Knot
from iiwa_sim.motion.joints import Joints

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


class TrajectoryPoint(NamedTuple):
    """Where joints shall be, in the order of the joints' names."""

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
    """Whether the last point may have a velocity: for streams of trajectories, each of which replaces
    another."""


class Tolerances(NamedTuple):
    """Tolerances of all joints in the robot's order; inf where nothing is compared."""

    position: Joints
    """rad"""
    velocity: Joints
    """rad/s"""


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
    """Where each of the robot's joints, `names`, is among those of a message. Raises `Refused`."""
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
