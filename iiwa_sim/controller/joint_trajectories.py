"""Joint trajectories of one robot: checked, accepted, compared with where the robot is, and ended.

Meanings, defaults and errors are those of ros2_controllers' joint_trajectory_controller, so its clients drive
this robot, too: https://control.ros.org, joint_trajectory_controller.
"""

from collections.abc import Mapping, Sequence
from math import inf, isfinite
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from iiwa_sim.controller.endings import PendingMove, WhenEnded
from iiwa_sim.controller.errors import EXECUTION, REPLACED, STOP_TRIGGERED, Refused
from iiwa_sim.controller.modes import Mode
from iiwa_sim.controller.planner import ROUNDING_RAD, outside
from iiwa_sim.motion.joint_trajectory import Knot, Reference
from iiwa_sim.motion.joints import Joints

if TYPE_CHECKING:
    from iiwa_sim.controller.controller import Controller

MOST_POINTS = 2000
"""A trajectory of more is refused: taking one of so many costs 20 ms, in which ticks are late."""
LONGEST_S = 86400.0
"""A trajectory that takes longer is refused: its times are a mistake."""
END_VELOCITY_RAD_S = 1.19e-7
"""Largest velocity of the last point: what joint_trajectory_controller takes for 0."""
ROUNDING = 1e-6
"""Part of a limit of velocity by which a curve may pass it, for rounding at its sender."""
START_RAD = 0.087
"""A trajectory that begins farther from the robot on any joint is refused: as far as a direct move goes."""
PREEMPTED, CANCELLED = "preempted by a newer trajectory", "cancelled"
PATH_TOLERANCE, GOAL_TOLERANCE = "path tolerance", "goal tolerance"
"""The beginning of the reason for the end of a trajectory from which the robot is too far."""


class TrajectoryRequest(NamedTuple):
    """A requested trajectory."""

    joints: Sequence[str]
    """Names, each of the robot's once, in any order."""
    points: Sequence[Knot]
    """In the order of these names, at times since the beginning."""
    delay_s: float = 0.0
    """How far in the future the trajectory begins; below 0 points that are over are left out."""
    may_end_fast: bool = False
    """True if the last point may have a velocity: for a stream of trajectories that replace each other."""
    path_tolerance: Mapping[str, float] = {}
    """Largest distance (rad) of a joint from the trajectory, by name; 0 or less for any."""
    goal_tolerance: Mapping[str, float] = {}
    goal_time_s: float = 0.0
    """Time after the end of the trajectory from which `goal_tolerance` is compared; 0 or less for never."""


class Progress(NamedTuple):
    """Progress of a trajectory in a tick. Joints are in the robot's order: rad, rad/s, rad/s^2."""

    time_s: float
    """Since its beginning, at the rate of the override."""
    desired: tuple[Joints, Joints, Joints]
    """Positions, velocities and accelerations of the trajectory."""
    actual: tuple[Joints, Joints]
    """Positions and velocities of the robot."""


class JointTrajectories:
    """Joint trajectories of one robot, each ended when it goes beyond its tolerances."""

    def __init__(self, controller: "Controller") -> None:
        self._controller = controller
        d = controller.description
        self._names, fastest = d.joints, (1.0 + ROUNDING) * np.array(d.velocity)
        lowest, highest = np.array(d.position_min) - ROUNDING_RAD, np.array(d.position_max) + ROUNDING_RAD
        self._bounds = (lowest, highest), (-fastest, fastest)  # of positions, and of velocities
        self._request = TrajectoryRequest((), ())  # the newest one

    def follow(self, request: TrajectoryRequest, when_ended: WhenEnded | None = None) -> int:
        """Accept a trajectory in place of the running motion; return its number.

        It begins at once where the robot rests or follows another one, else when the robot has come to rest.
        Raises `Refused`, and then nothing has changed.
        """
        controller = self._controller
        motions = controller.motions
        controller.errors.check()
        controller.check_hold()
        knots = knots_of(request, self._names)
        followed = None if controller.mode.stops_for(Mode.TRAJECTORY) else motions.tracked
        here = motions.rest_after_stop()
        still = (0.0,) * len(here)
        state = (here, still, still) if followed is None else followed.reference.at(motions.tracked_s)
        reference = Reference(_from_here(knots, *state))
        self._check(reference, state[0])
        try:
            trajectory = motions.plan_trajectory(reference, controller.planner.servo_limits[Mode.DIRECT])
        except ArithmeticError:
            raise Refused(EXECUTION, "the trajectory cannot be joined from the present motion") from None
        replaced = PREEMPTED if controller.mode is Mode.TRAJECTORY else REPLACED
        number = controller.begin(Mode.TRAJECTORY, lambda n: motions.track(n, trajectory), replaced)
        controller.endings.pending.append(PendingMove(number, when_ended))
        self._request = request
        return number

    def cancel(self, number: int) -> None:
        """Stop on the trajectory of this number, or forget it if it waits."""
        if self._controller.motions.is_pending(number):
            self._end(CANCELLED)

    def after_tick(self) -> None:
        """Stop a robot that is too far from the trajectory that it follows."""
        motions, request = self._controller.motions, self._request
        if not (request.path_tolerance or request.goal_tolerance) or (followed := motions.tracked) is None:
            return
        time_s = motions.tracked_s
        late_s = time_s - followed.reference.end_s
        kind, tolerances = PATH_TOLERANCE, request.path_tolerance
        if late_s >= 0.0:
            kind, tolerances = GOAL_TOLERANCE, request.goal_tolerance
            if request.goal_time_s <= 0.0 or late_s <= request.goal_time_s:
                return
        wanted = followed.reference.at(time_s)[0] if tolerances else ()
        for name, place, here in zip(self._names, wanted, motions.joints, strict=False):
            off, most = abs(place - here), tolerances.get(name, 0.0)
            if off > most > 0.0:
                self._end(f"{kind}: {name} is {off:.7g} rad off after {time_s:.3f} s, more than {most:g} rad")
                return

    def _end(self, reason: str) -> None:
        with self._controller.endings.because(STOP_TRIGGERED, reason):
            self._controller.motions.end_trajectory()

    @property
    def progress(self) -> Progress | None:
        """The state of the trajectory that is followed; None while there is none."""
        motions = self._controller.motions
        if (followed := motions.tracked) is None:
            return None
        time_s, actual = motions.tracked_s, (motions.joints, self._controller.joint_velocity())
        return Progress(time_s, followed.reference.at(time_s), actual)

    def _check(self, reference: Reference, here: Joints) -> None:
        """Raise `Refused` where the reference passes limits or begins elsewhere."""
        for order, (low, high) in enumerate(self._bounds):
            if (beyond := reference.first_beyond(order, low, high)) is not None:
                time_s, k = beyond
                joint = f"after {time_s:.3f} s {self._names[k]}"
                if order == 0:
                    raise outside(joint, reference.at(time_s)[0][k], low[k], high[k])
                raise Refused(EXECUTION, f"{joint} is faster than its limit of {high[k]:.6g} rad/s")
        away = np.abs(np.subtract(reference.at(0.0)[0], here))
        farthest = int(away.argmax())
        if away[farthest] > START_RAD:
            where = f"{self._names[farthest]} is {away[farthest]:.7g} rad from where the trajectory begins"
            raise Refused(EXECUTION, f"{where}: expected {START_RAD:g} rad at most")


def knots_of(request: TrajectoryRequest, names: Sequence[str]) -> list[Knot]:
    """Return the points in the order of the robot's joints, at their times from now on. Raises `Refused`."""
    order, points, delay_s = order_of(request.joints, names), request.points, request.delay_s
    if not 1 <= len(points) <= MOST_POINTS:
        raise Refused(EXECUTION, f"a trajectory with {len(points)} points: expected 1 to {MOST_POINTS}")
    last, before_s, knots = points[-1], -inf, list[Knot]()
    if not max(last.time_s, abs(delay_s)) <= LONGEST_S:
        raise Refused(EXECUTION, f"expected at most {LONGEST_S:g} s long, stamped within a day from now")
    for k, point in enumerate(points):
        if point.time_s < 0.0 or not before_s < point.time_s:
            later = "is not later than the one before, or below 0 s"
            raise Refused(EXECUTION, f"point {k} at {point.time_s:g} s {later}")
        before_s = point.time_s
        for what, given in zip(Knot._fields[1:], point[1:], strict=True):
            if len(given) != len(order) and (given or what == "positions"):
                raise Refused(EXECUTION, f"point {k} has {len(given)} {what}: expected {len(order)}")
            if not all(map(isfinite, given)):
                raise Refused(EXECUTION, f"point {k}: {what} that are not finite")
        rows = [tuple(row[place] for place in order) if row else () for row in point[1:]]
        knots.append(Knot(point.time_s + delay_s, *rows))
    if knots[-1].time_s < 0.0:
        raise Refused(EXECUTION, f"the trajectory ended {-knots[-1].time_s:.3f} s ago")
    if last.velocities and not request.may_end_fast:
        if max(map(abs, last.velocities)) > END_VELOCITY_RAD_S:
            raise Refused(EXECUTION, f"point {len(points) - 1}, the last one, has a velocity other than 0")
        knots[-1] = knots[-1]._replace(velocities=(0.0,) * len(order))
    return knots


def order_of(joints: Sequence[str], names: Sequence[str]) -> list[int]:
    """Return the places of the robot's joints, `names`, in a message. Raises `Refused`."""
    if sorted(joints) != sorted(names):
        wrong = ", ".join(repr(name[:40]) for name in joints[:8])
        raise Refused(EXECUTION, f"joint_names {wrong}: expected each of {', '.join(names)} once")
    return [list(joints).index(name) for name in names]


def _from_here(knots: list[Knot], position: Joints, velocity: Joints, acceleration: Joints) -> list[Knot]:
    """Return the knots from now on: with the present state in front, or without points that are over."""
    if knots[0].time_s > 0.0:
        return [Knot(0.0, position, velocity, acceleration), *knots]
    later = [k for k, knot in enumerate(knots) if knot.time_s > 0.0]
    if not later:  # one point, for now
        place = knots[-1].positions
        return [Knot(0.0, place), Knot(1e-4, place)]
    return knots[later[0] - 1 :]
