"""The lookahead extends the running trajectory into the moves that wait, in slices over ticks."""

from collections.abc import Sequence
from itertools import pairwise
from math import ceil

from iiwa_sim.motion.blend import Blend, Move, blend, half_times_s, may_blend
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.plan_kernel import BlendedPath
from iiwa_sim.motion.speed_profile import Slices
from iiwa_sim.motion.time_scaling import TimeScaling
from iiwa_sim.motion.trajectory import AT_START, Trajectory, alone, planned, planned_on

HORIZON_S = 1.0
"""A trajectory is extended into moves that wait once less than this lies ahead."""
MOST_AT_ONCE, BATCH_S = 30, 4.0
"""The most moves it is extended into at once; fewer if these take about so long."""
TINY_S, SHORT_S = 0.035, 0.2
"""A move that takes so long from rest to rest is planned together with those behind it.
Once the robot moves there would be too little time."""
MOST_AT_FIRST, ENOUGH_S = 12, 0.3
"""Moves are planned together from rest until they are so many, or take this long."""
SHORTEST_S = 0.08
"""A trajectory that takes less is not extended: the moves behind it are planned from rest while it runs."""
SLICE_S, MOST_SLICES, MOST_AT_REST = 0.0025, 2, 3
"""A tick computes one slice for each `SLICE_S` that it has begun, at most so many; more at rest."""
SLICES, SLICES_AHEAD, SLICES_OF_MOVE, SLICES_PER_S = 7, 12, 1.0, 5.0
"""Approximate slices of a plan with few segments, and of one that extends a trajectory.
Each move adds some, and each second of it up to `LONG_S`."""
LONG_S = 1.5
LEAST_MARGIN_S = 0.01
LONGEST_S = 0.2
"""A change of a trajectory begins no later than this after now."""
ROUNDING = 1e-9
ABOUT = 0.95
"""Accuracy of `alone_s` for moves whose joints do not go straight."""


class _Start:
    """The plan of moves from rest, finished or not."""

    def __init__(self, number: int, work: Slices[Trajectory]) -> None:
        """`number` is that of the first move."""
        self.number = number
        self.found: Trajectory | None = None
        self._work = work

    def go_on(self, slices: int) -> None:
        for _ in range(slices if self.found is None else 0):
            try:
                next(self._work)
            except StopIteration as end:
                self.found = end.value
                return


class LookAhead:
    """Planner that extends a trajectory into waiting moves by blends; else it plans them from rest."""

    def __init__(self, time: TimeScaling, lowest: Array, highest: Array) -> None:
        """`lowest` and `highest` are the position limits (n,), in rad."""
        self._time = time
        self._slices = min(ceil(time.tick_s / SLICE_S - ROUNDING), MOST_SLICES)
        self._margin_s = max((SLICES / self._slices + 1.0) * time.tick_s, LEAST_MARGIN_S)
        self._position_limits = lowest, highest
        self.forget()

    def forget(self) -> None:
        """Begin anew: another trajectory runs, or other moves wait."""
        self._work: Slices[Trajectory | None] | None = None
        self._start: _Start | None = None
        self._rejected = 0  # number of the last move that is left to set out from rest
        self.quiet_until_s = 0.0
        """Until this planned time `step` has nothing to do, with the same trajectory and the same moves."""

    def begin(self, waiting: Sequence[Move]) -> Trajectory | None:
        """Return a trajectory to set out with from rest; None while it is being planned."""
        start = self._from_rest(waiting)
        start.go_on(MOST_AT_REST)
        found = start.found
        if found is not None and list(waiting[: len(found.moves)]) != list(found.moves):
            self._start = None  # waiting moves have been dropped meanwhile
            return None
        return found

    def step(self, trajectory: Trajectory, waiting: Sequence[Move]) -> Trajectory | None:
        """Plan for a tick. Return a trajectory that replaces the running one; None while that stays."""
        self.quiet_until_s = trajectory.end_s
        if not waiting or waiting[0].length_s == 0.0:
            return None
        soon = trajectory.end_s - self._time.time_s < HORIZON_S
        self.quiet_until_s = 0.0 if soon else trajectory.end_s - HORIZON_S
        if not soon and self._work is None:
            return None
        if not self._may_go_on(trajectory, waiting[0]):
            start = self._from_rest(waiting)
            start.go_on(self._slices)
            self.quiet_until_s = trajectory.end_s if start.found else 0.0
            return None
        for _ in range(self._slices):
            if self._work is None:
                self._work = self._on(trajectory, waiting)
            try:
                next(self._work)
            except StopIteration as end:
                self._work = None
                extended: Trajectory | None = end.value
                return extended
        return None

    def _from_rest(self, waiting: Sequence[Move]) -> _Start:
        """Return the plan, finished or not, of what sets out with the first of `waiting`."""
        if self._start is None or self._start.number != waiting[0].number:
            self._start = _Start(waiting[0].number, self._first(waiting[:MOST_AT_FIRST]))
        return self._start

    def _may_go_on(self, trajectory: Trajectory, move: Move) -> bool:
        """Return whether a trajectory may be extended into a move."""
        if move.number == self._rejected or trajectory.end_s < SHORTEST_S:
            return False
        return may_blend(trajectory.moves[-1], move)

    def _first(self, moves: Sequence[Move]) -> Slices[Trajectory]:
        """Return the trajectory from rest along the first of `moves`, and those behind it if it is short."""
        first = yield from alone(moves[0])
        if TINY_S < first.end_s < SHORT_S:
            blends = yield from self._blends(moves, ENOUGH_S)
            moves = moves[: len(blends) + 1]
            found = (yield from planned(BlendedPath(moves, blends), AT_START)) if blends else None
            if found is not None and not (yield from _slower(found.end_s, moves)):
                return found
        return first

    def _needed_s(self, trajectory: Trajectory, moves: Sequence[Move]) -> float:
        """Return the time (s), about, that it takes to extend a trajectory into moves; less near its end."""
        slices = SLICES_AHEAD + sum(SLICES_OF_MOVE + SLICES_PER_S * min(m.length_s, LONG_S) for m in moves)
        needed_s = (slices / self._slices + 1.0) * self._time.tick_s
        left_s = trajectory.end_s - self._time.time_s
        return max(self._margin_s, min(needed_s, 0.5 * left_s, LONGEST_S))

    def _blends(self, moves: Sequence[Move], enough_s: float) -> Slices[list[Blend]]:
        """Return blends between moves, until one has to be a stop, or they take long enough at full speed."""
        blends: list[Blend] = []
        ahead_s = 0.0
        for one, other in pairwise(moves):
            found = blend(one, other, *self._position_limits) if may_blend(one, other) else None
            if found is None or (blends and ahead_s > enough_s):
                break
            blends.append(found)
            ahead_s += other.length_s
            if len(blends) % 2 == 0:
                yield
        return blends

    def _on(self, trajectory: Trajectory, moves: Sequence[Move]) -> Slices[Trajectory | None]:
        """Return the trajectory extended into as many of `moves` as possible; None if that fails."""
        number = moves[0].number
        blends = yield from self._blends([trajectory.moves[-1], *moves], BATCH_S)
        moves = moves[: len(blends)]
        tries = [(len(moves), 1.0), (len(moves), 2.0), (1, 1.0)]
        for count, patience in tries if moves else ():
            now_s = self._time.time_s
            then_s = now_s + patience * self._needed_s(trajectory, moves[:count])
            on = yield from planned_on(trajectory, now_s, then_s, moves[:count], blends[:count])
            if on is None or (yield from _slower(on.end_s - trajectory.end_s, moves[:count])):
                continue
            if on.front_s > self._time.time_s:  # else it is too late to replace the present one
                return on
        self._rejected = number
        return None


def alone_s(move: Move) -> float:
    """Return how long (s) a move takes from rest to rest at the least; about so for curved paths."""
    return (1.0 if move.path.straight else ABOUT) * half_times_s(move) if move.length_s else 0.0


def _slower(gained_s: float, moves: Sequence[Move]) -> Slices[bool]:
    """Return whether moves that take `gained_s` together would take less with stops between them."""
    for bound in (True, False):  # first a cheap one
        left_s = gained_s
        for count, move in enumerate(moves, start=1):
            left_s -= alone_s(move) if bound else (yield from alone(move)).end_s
            if left_s <= 0.0:
                return False
            if count % 8 == 0:
                yield
    return True
