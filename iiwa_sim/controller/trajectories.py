"""Joint trajectories of one robot: checked and taken, compared with where the robot is, and ended."""

from collections.abc import Callable
from enum import Enum
from math import inf
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from iiwa_sim.controller.endings import Ending, PendingMove
from iiwa_sim.controller.errors import EXECUTION, REPLACED, STOP_TRIGGERED, SUCCESS, Refused
from iiwa_sim.controller.lin_planner import ROUNDING_RAD
from iiwa_sim.controller.modes import TRANSITIONS, Event, Mode
from iiwa_sim.controller.moves import Moves
from iiwa_sim.controller.planner import outside
from iiwa_sim.controller.trajectory_request import (
    SHORTEST_S,
    STOPPED_RAD_S,
    Tolerances,
    TrajectoryRequest,
    knots_of,
    tolerances_of,
)
from iiwa_sim.controller.wanted import Tracked
from iiwa_sim.motion.joint_trajectory import Beyond, Knot, Reference
from iiwa_sim.motion.joints import Joints

if TYPE_CHECKING:
    from iiwa_sim.controller.controller import Controller

ROUNDING = 1e-6
"""Part of a limit of velocity by which a curve may pass it: rounding of who computed it."""
START_RAD = 0.087
"""A trajectory that begins farther from the robot on any joint is refused: as far as a direct move goes."""
PREEMPTED = "preempted by a newer trajectory"


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
    """Where a trajectory stands in a tick. Joints are in the robot's order: rad, rad/s, rad/s^2."""

    number: int
    time_s: float
    """Since its beginning, at the rate of the override."""
    desired: tuple[Joints, Joints, Joints]
    """What the trajectory asks for: positions, velocities and accelerations."""
    actual: tuple[Joints, Joints]
    """Where the robot is, and how fast."""


class _Active:
    """The trajectory that is followed or waits for the robot to rest."""

    def __init__(
        self, number: int, path: Tolerances, goal: Tolerances, goal_time_s: float, end_s: float
    ) -> None:
        self.number = number
        self.path, self.goal, self.goal_time_s, self.end_s = path, goal, goal_time_s, end_s
        self.compares_path = min(*path.position, *path.velocity) < inf
        self.outcome = Outcome.ENDED
        """How the trajectory counts as ended where it does not come to its goal."""


class Trajectories:
    """Takes joint trajectories for one robot, watches over the one that is followed, and tells how each
    ended."""

    def __init__(self, core: "Controller", moves: Moves) -> None:
        self._core = core
        self._moves = moves
        core.watch_trajectory = self._watch
        description = core.model.description
        self._names = description.joints
        self._lowest = np.array(description.position_min) - ROUNDING_RAD
        self._highest = np.array(description.position_max) + ROUNDING_RAD
        self._velocity = np.array(description.velocity)
        self._limits = core.targets.limits[Mode.DIRECT]
        self._active: _Active | None = None

    def take(self, request: TrajectoryRequest, when_ended: TrajectoryEnded | None) -> tuple[int, str]:
        """Take a trajectory in place of what runs; gives its number, and a remark on how it was understood.

        It begins at once where the robot rests or follows another one, else when the robot has come to rest.
        Raises `Refused`, and then nothing has changed.
        """
        core = self._core
        core.errors.check()
        self._moves.check_hold()
        knots = knots_of(request, self._names)
        path, note = tolerances_of(request.path_tolerance, self._names)
        goal, goal_note = tolerances_of(request.goal_tolerance, self._names, STOPPED_RAD_S)
        change = TRANSITIONS[core.mode, Event.TRAJECTORY]
        followed = None if change.stops else core.motions.tracked
        here = core.motions.rest_after_stop()
        still = (0.0,) * len(here)
        position, velocity, acceleration = here, still, still
        if followed is not None:
            position, velocity, acceleration = followed.reference.at(core.motions.tracked_s)
        reference = Reference(_from_here(knots, position, velocity, acceleration))
        self._check(reference, position)
        try:
            way = core.motions.plan_way(reference, self._limits)
        except ArithmeticError:
            raise Refused(EXECUTION, "no way from the present motion onto the trajectory") from None
        with core.endings.because(STOP_TRIGGERED, PREEMPTED if core.mode is Mode.TRAJECTORY else REPLACED):
            number = self._moves.accept(Event.TRAJECTORY)
            core.motions.track(Tracked(number, way))
        active = _Active(number, path, goal, request.goal_time_s, reference.end_s)

        def ended(ending: Ending) -> None:
            if self._active is active:
                self._active = None
            if when_ended is not None:
                outcome = Outcome.REACHED if ending.code == SUCCESS else active.outcome
                when_ended(TrajectoryEnd(outcome, ending.reason))

        core.endings.pending.append(PendingMove(number, ended, None))
        self._active = active
        return number, "; ".join(filter(None, (note, goal_note)))

    def cancel(self, number: int) -> bool:
        """Stop on the way of the trajectory of this number; gives whether it was followed or waited."""
        if not self._core.is_pending(number):
            return False
        if self._active is not None and self._active.number == number:
            self._end(Outcome.CANCELLED, "cancelled")
        return True

    @property
    def progress(self) -> Progress | None:
        """How far the trajectory that is followed has come; None while there is none."""
        motions, active = self._core.motions, self._active
        followed = motions.tracked
        if followed is None or active is None:
            return None
        time_s, actual = motions.tracked_s, (motions.joints, self._core.joint_velocity())
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
        active, motions = self._active, self._core.motions
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
        if self._active is not None:
            self._active.outcome = outcome
        with self._core.endings.because(STOP_TRIGGERED, reason):
            self._core.motions.end_trajectory()


def _from_here(knots: list[Knot], position: Joints, velocity: Joints, acceleration: Joints) -> list[Knot]:
    """Knots from now on: with where the curve sets out in front, or without what is over."""
    if knots[0].time_s > 0.0:
        return [Knot(0.0, position, velocity, acceleration), *knots]
    first = next((k for k, knot in enumerate(knots) if knot.time_s > 0.0), None)
    if first is None:  # one point, for now: a way of no length
        place = knots[-1].positions
        return [Knot(0.0, place), Knot(SHORTEST_S, place)]
    return knots[first - 1 :]
