"""The lookahead: plans the trajectory under way on into the moves that wait, in slices over ticks."""

from collections import deque
from collections.abc import Iterable, Sequence
from itertools import islice, pairwise
from math import ceil
from typing import NamedTuple

from iiwa_sim.motion.blend import Blend, Move, blend, half_times_s, may_blend
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.plan_kernel import BlendedPath
from iiwa_sim.motion.speed_profile import Slices
from iiwa_sim.motion.time_scaling import TimeScaling
from iiwa_sim.motion.trajectory import AT_START, FREE_S, Trajectory, begun, planned, planned_on

HORIZON_S = 1.0
"""A trajectory is planned on into moves that wait once less than this lies ahead."""
MOST_AT_ONCE, BATCH_S = 30, 4.0
"""The most moves it is planned on into at once; fewer if these take about so long."""
SHORT_S = 0.05
"""A move that takes less at its full speed is short. Short moves are planned together before the robot sets
out, if the first of them, alone from rest to rest, takes between `TINY_S` and `LONG_ENOUGH_S`."""
LONG_ENOUGH_S = 0.2
TINY_S = 0.035
"""Below this there is nothing to gain, except with several such moves that take twice as long together."""
MOST_AT_FIRST, ENOUGH_S = 12, 0.3
"""Short moves are planned together until they are so many, or take this long."""
MOST_WAIT_S, WORTH_WAITING = 0.1, 0.5
"""The longest that the robot waits for them: so long, and that part of the time that it can gain."""
SHORTEST_S = 0.08
"""A trajectory that takes less is not planned on into short moves: they are planned together while it runs.
For two moves, the first of which takes more alone, the robot does not wait at all."""
SLICE_S, MOST_SLICES = 0.0025, 2
"""A tick computes one slice for each `SLICE_S` that it has begun, at most so many."""
SLICES = 7
"""A plan of few segments takes about so many slices."""
LEAST_MARGIN_S = 0.01
SEGMENT_S, SEGMENTS_OF_MOVE, SEGMENTS_IN_SLICE = 0.01, 10, 20.0
"""About the length of a segment, how many a short move has, and how many of a plan a slice computes."""
LONG_S = 1.5
"""A longer move has no more segments than one of this length."""
MORE_PATIENCE, MOST_PATIENCE = 1.7, 2.0
"""If a plan came too late, the next try is given so many times more time, until that is more than so many
times the first."""
LONGEST_S = 0.2
"""A change of a trajectory begins no later than this after now."""
MOST_TRIES = 6
"""To make a rough trajectory faster, each with twice the time of the one before."""
LEAST_PACE = 0.02
SHARES = (1.0, 0.6)
"""Parts of a blend that are tried one after the other, until a profile is found."""
ROUNDING = 1e-9
ABOUT = 0.95
"""Accuracy of `alone_s` for moves whose joints do not go straight."""


class Ahead(NamedTuple):
    """A trajectory in place of the one under way."""

    trajectory: Trajectory
    moves: int
    """How many of the moves that waited are part of it."""


class _SettingOut:
    """Short moves that are planned together before they set out from rest."""

    def __init__(self, number: int, work: Slices[Ahead | None]) -> None:
        """`number` is that of the first move; `work` ends with their trajectory, or None."""
        self.number = number
        self.over = False
        self.ahead: Ahead | None = None
        self._work = work

    def go_on(self, slices: int) -> None:
        for _ in range(slices if not self.over else 0):
            try:
                next(self._work)
            except StopIteration as end:
                self.over, self.ahead = True, end.value
                return


class LookAhead:
    """Makes a trajectory as fast as it can be while it runs, and extends it into moves that wait if it may
    blend into them."""

    def __init__(self, time: TimeScaling, lowest: Array, highest: Array) -> None:
        """`lowest` and `highest` are the position limits (n,), in rad."""
        self._time = time
        self._slices = min(ceil(time.tick_s / SLICE_S - ROUNDING), MOST_SLICES)
        self._margin_s = max((SLICES / self._slices + 1.0) * time.tick_s, LEAST_MARGIN_S)
        self._position_limits = lowest, highest
        self.forget()

    def forget(self) -> None:
        """Begin anew: another trajectory is under way, or other moves wait."""
        self._work: Slices[Ahead | None] | None = None
        self._setting_out: _SettingOut | None = None
        self._waits_s = 0.0  # so long at the most for what sets out
        self._tries = 0  # to make the trajectory faster
        self._rejected = 0  # number of the last move that is left to set out from rest
        self.quiet_until_s = 0.0
        """Until this planned time `step` has nothing to do, with the same trajectory and the same moves."""

    def begin(self, waiting: deque[Move]) -> Ahead | None:
        """Return a trajectory to set out with from rest; None while short moves are planned together."""
        first = waiting[0]
        if len(waiting) < 2 or not _are_short(waiting):
            return Ahead(begun(first), 1)
        planning = self._setting_out is not None and self._setting_out.number == first.number
        if not planning and len(waiting) == 2 and (alone := begun(first)).end_s >= SHORTEST_S:
            return Ahead(alone, 1)
        setting_out = self._set_out(waiting)
        setting_out.go_on(self._slices)
        self._waits_s -= self._time.tick_s
        if not setting_out.over and self._waits_s > 0.0:
            return None
        ahead = setting_out.ahead
        # Waiting moves may have been forgotten meanwhile.
        if ahead is None or list(islice(waiting, ahead.moves)) != list(ahead.trajectory.moves):
            return Ahead(begun(first), 1)
        return ahead

    def step(self, trajectory: Trajectory, waiting: deque[Move]) -> Ahead | None:
        """Plan for a tick. Return a trajectory that replaces the one under way; None while that stays."""
        self.quiet_until_s = 0.0
        rejected = bool(waiting) and waiting[0].number == self._rejected
        if (rejected or trajectory.end_s < SHORTEST_S) and len(waiting) > 1 and _are_short(waiting):
            self._set_out(waiting).go_on(self._slices)
            return None
        for _ in range(self._slices):
            if self._work is None:
                self._work = self._next(trajectory, waiting)
                if self._work is None:
                    on = self._may_go_on(trajectory, waiting)
                    self.quiet_until_s = trajectory.end_s - (HORIZON_S if on else 0.0)
                    return None
            try:
                next(self._work)
            except StopIteration as end:
                self._work = None
                ahead: Ahead | None = end.value
                # Comparing with a stop takes slices, too.
                if ahead is None or self._in_time(ahead.trajectory):
                    return ahead
                return None
        return None

    def _set_out(self, waiting: deque[Move]) -> _SettingOut:
        """The plan, begun or under way, of short moves that set out with the first of `waiting`."""
        if self._setting_out is None or self._setting_out.number != waiting[0].number:
            moves = list(islice(waiting, MOST_AT_FIRST))
            self._setting_out = _SettingOut(moves[0].number, self._first(moves))
            # The most that leaving out all stops between short moves can save.
            gain_s = sum(alone_s(move) for move in moves if move.length_s < SHORT_S)
            self._waits_s = min(WORTH_WAITING * gain_s, MOST_WAIT_S)
        return self._setting_out

    def _in_time(self, found: Trajectory) -> bool:
        """Return whether the front of a trajectory is still ahead, so it can replace the present one."""
        return found.front_s > self._time.time_s

    def _next(self, trajectory: Trajectory, waiting: deque[Move]) -> Slices[Ahead | None] | None:
        """Return the planning that is due: on into moves that wait, or of a faster trajectory; or None."""
        soon = trajectory.end_s - self._time.time_s < HORIZON_S
        if soon and self._may_go_on(trajectory, waiting):
            return self._on(trajectory, list(islice(waiting, MOST_AT_ONCE)))
        if trajectory.rough and self._tries < MOST_TRIES:
            self._tries += 1
            return self._faster(trajectory)
        return None

    def _may_go_on(self, trajectory: Trajectory, waiting: deque[Move]) -> bool:
        """Return whether a trajectory may be planned on into moves that wait."""
        if not waiting or waiting[0].number == self._rejected:
            return False
        return may_blend(trajectory.moves[-1], waiting[0])

    def _faster(self, trajectory: Trajectory) -> Slices[Ahead | None]:
        now_s = self._time.time_s
        then_s = now_s + 2.0 ** (self._tries - 1) * self._needed_s(trajectory, [])
        faster = yield from planned_on(trajectory, now_s, then_s, [], [])
        if faster is None or faster.end_s >= trajectory.end_s:
            return None
        return Ahead(faster, 0)

    def _first(self, moves: Sequence[Move]) -> Slices[Ahead | None]:
        """A trajectory from rest along the first of `moves`; None if none was found."""
        blends = yield from self._blends(moves, 1.0, ENOUGH_S)
        for count in sorted({len(blends), 1}, reverse=True) if blends else ():
            found = yield from planned(BlendedPath(moves[: count + 1], blends[:count]), AT_START)
            if found is not None and not (yield from _slower(found.end_s, moves[: count + 1])):
                return Ahead(found, count + 1)
        return None

    def _needed_s(self, trajectory: Trajectory, moves: Sequence[Move]) -> float:
        """The time (s), about, that it takes to extend a trajectory into `moves`; less if it ends before."""
        now_s, rest_s = self._time.time_s, trajectory.end_s
        segments: float = trajectory.segments_behind(max(now_s, rest_s - 2.0 * FREE_S))
        segments += sum(SEGMENTS_OF_MOVE + min(move.length_s, LONG_S) / SEGMENT_S for move in moves)
        slices = SLICES + segments / SEGMENTS_IN_SLICE
        needed_s = (slices / self._slices + 1.0) * self._time.tick_s
        return max(self._margin_s, min(needed_s, 0.5 * (rest_s - now_s), LONGEST_S))

    def _blends(self, moves: Sequence[Move], pace: float, enough_s: float) -> Slices[list[Blend]]:
        """Blends between moves, until one has to be a stop, or they take long enough at a pace (dx/dt)."""
        blends: list[Blend] = []
        ahead_s = 0.0
        for one, other in pairwise(moves):
            found = blend(one, other, *self._position_limits) if may_blend(one, other) else None
            if found is None or (blends and ahead_s > enough_s):
                break
            blends.append(found)
            ahead_s += other.length_s / pace
            if len(blends) % 2 == 0:
                yield
        return blends

    def _on(self, trajectory: Trajectory, moves: Sequence[Move]) -> Slices[Ahead | None]:
        """The trajectory extended into as many of `moves` as possible; None if that fails."""
        number = moves[0].number
        now_s = self._time.time_s
        pace = (trajectory.path.end_x - trajectory.x(now_s)) / max(trajectory.end_s - now_s, 1e-3)
        pace = min(max(pace, LEAST_PACE), 1.0)
        blends = yield from self._blends([trajectory.moves[-1], *moves], pace, BATCH_S)
        moves = moves[: len(blends)]
        tries = [(len(moves), share) for share in SHARES]
        if len(moves) > 1:
            tries.append((1, 1.0))
        patience = 1.0
        rests_s: float | None = None
        for count, share in tries if moves else ():
            first = blends[0]._replace(before=share * blends[0].before, after=share * blends[0].after)
            while True:
                now_s = self._time.time_s
                then_s = now_s + patience * self._needed_s(trajectory, moves[:count])
                on = yield from planned_on(
                    trajectory, now_s, then_s, moves[:count], [first, *blends[1:count]]
                )
                if on is None:
                    break
                if self._in_time(on):
                    gained_s = on.end_s - _at_least_s(trajectory)
                    if (yield from _may_be_slower(gained_s, moves[:count])):
                        if rests_s is None:
                            rests_s = yield from self._rests_s(trajectory)
                        if (yield from _slower(on.end_s - rests_s, moves[:count])):
                            break
                    if self._in_time(on):
                        return Ahead(on, count)
                elif patience > MOST_PATIENCE:
                    break
                else:
                    patience *= MORE_PATIENCE
        self._rejected = number
        return None

    def _rests_s(self, trajectory: Trajectory) -> Slices[float]:
        """When the trajectory under way ends (s), once it is as fast as it can be."""
        if not trajectory.rough:
            return trajectory.end_s
        yield
        now_s = self._time.time_s
        faster = yield from planned_on(trajectory, now_s, now_s + self._margin_s, [], [])
        return min(faster.end_s, trajectory.end_s) if faster else trajectory.end_s


def alone_s(move: Move) -> float:
    """Return how long (s) a move takes from rest to rest at the least; about so for curved paths."""
    if move.length_s == 0.0:
        return 0.0
    return (1.0 if move.path.straight else ABOUT) * half_times_s(move)


def _at_least_s(trajectory: Trajectory) -> float:
    """A lower bound of when the trajectory under way ends (s), once it is as fast as it can be."""
    if not trajectory.rough:
        return trajectory.end_s
    return min(trajectory.end_s, sum(map(alone_s, trajectory.moves)))


def _may_be_slower(gained_s: float, moves: Sequence[Move]) -> Slices[bool]:
    """Return whether moves that take `gained_s` together might take less with stops: a cheap bound."""
    for count, move in enumerate(moves, start=1):
        gained_s -= alone_s(move)
        if gained_s <= 0.0:
            return False
        if count % 8 == 0:
            yield
    return True


def _slower(gained_s: float, moves: Sequence[Move]) -> Slices[bool]:
    """Return whether moves that take `gained_s` together would take less with stops between them."""
    if not (yield from _may_be_slower(gained_s, moves)):
        return False
    stopping_s = 0.0
    for move in moves:
        yield
        stopping_s += begun(move).end_s
        if stopping_s >= gained_s:
            return False
    return True


def _are_short(waiting: deque[Move]) -> bool:
    """Return whether the first of two or more moves are to be planned together before setting out."""
    if waiting[0].length_s >= SHORT_S or not may_blend(waiting[0], waiting[1]):
        return False
    first_s = alone_s(waiting[0])
    return TINY_S < first_s < LONG_ENOUGH_S or (first_s <= TINY_S and _are_worth_it(waiting))


def _are_worth_it(waiting: Iterable[Move]) -> bool:
    """Return whether tiny moves are so many that there is something to gain, all together."""
    gain_s = 0.0
    for one, other in pairwise(islice(waiting, MOST_AT_FIRST)):
        one_s = alone_s(one)
        if one_s > 2.0 * TINY_S or not may_blend(one, other):
            return False
        gain_s += one_s
        if gain_s > 2.0 * TINY_S:
            return True
    return False
