"""The look ahead: takes the moves that wait into the run under way, so that it goes on without a stop.

A corner that can be driven round without losing speed is; at any other the robot turns at the target, except
where to stop there is over sooner. To plan that costs a few milliseconds, so it is done in slices of about
half of one.
"""

from collections import deque
from itertools import islice
from math import ceil
from typing import NamedTuple

from iiwa_sim.motion.chain import Chain, Way
from iiwa_sim.motion.corner import rounded, turning_share
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.overlap import set_out_s
from iiwa_sim.motion.rate import PlannedTime
from iiwa_sim.motion.run import Run
from iiwa_sim.motion.slices import Slices, at_most, at_once

LOOK_AHEAD_S = 1.0
"""While less than this of a run is planned, moves that wait are taken into it."""
MOST_AT_ONCE = 6
"""So many: what a chain costs to plan grows with them."""
ENOUGH_S = 0.25
"""A run begins with moves that take at least so long, if it can."""
SLICE_S = 0.0025
"""A tick has a slice for each of these that it has begun."""
MOST_SLICES = 10
"""A change of what is under way is planned in no more, and changes nothing before it is done."""

SURE_WINDOWS = 4.5
"""To turn with a share of the acceleration limits costs about three windows of the moving average, times what
is missing of 1; where an overlap saves more than so many, stopping need not be looked at."""
ROUNDING = 1e-9


class Taken(NamedTuple):
    """What a look ahead has changed."""

    moves: int
    """So many that waited are part of the run,"""
    from_s: float
    """which is as it was up to this time."""


class LookAhead:
    """Looks at each move that waits once."""

    def __init__(self, time: PlannedTime, lowest: Array, highest: Array) -> None:
        """The limits of joint positions are in rad (n,)."""
        self._time = time
        self._slices_per_tick = ceil(time.tick_s / SLICE_S - ROUNDING)
        self._margin_s = (MOST_SLICES / self._slices_per_tick + 1.0) * time.tick_s
        self._position_limits = lowest, highest
        self._looked_at = 0  # the number of the last move looked at
        self._sharp = 0  # that of the last move that a sharp corner was found before
        self._look: Slices[Taken | None] | None = None

    def forget(self) -> None:
        """Begin anew: there is another run, or other moves wait."""
        self._look = None
        self._looked_at = self._sharp = 0

    def first_chain(self, waiting: deque[Move]) -> Chain:
        """One of the next move, and of those after it as long as it is short: there would be no time to look
        ahead. These do not wait any more."""
        way = Way(waiting[0])
        moves = list(islice(waiting, 1, MOST_AT_ONCE))
        slices = self._follow(way, moves)
        while way.length_s < ENOUGH_S and next(slices, self) is not self:
            pass
        for _ in range(1 + len(way.corners)):
            waiting.popleft()
        way.end_share = 1.0  # that it pays to brake gently shows with the next look
        return at_once(Chain.along(way))

    def step(self, run: Run, waiting: deque[Move]) -> Taken | None:
        """The slices of a tick; None while nothing changes."""
        for _ in range(self._slices_per_tick):
            if self._look is None:
                if not waiting or run.rest_s - self._time.time_s > LOOK_AHEAD_S:
                    return None
                following = waiting[0]
                if following.number == self._looked_at or not _may_blend(run.last.moves[-1], following):
                    return None
                self._looked_at = following.number
                self._look = self._slices(run, list(islice(waiting, MOST_AT_ONCE)))
            try:
                next(self._look)
            except StopIteration as end:
                self._look = None
                taken: Taken | None = end.value
                return taken
        return None

    def _slices(self, run: Run, moves: list[Move]) -> Slices[Taken | None]:
        before, following = run.last.moves[-1], moves[0]
        way = Way(before)
        yield from self._follow(way, moves)
        if way.corners:
            now_s, then_s = self._now_and_then(run)
            driven, count = yield from at_most(MOST_SLICES, _driving(run.last, way, now_s, then_s))
            if count:
                run.replace_last(driven)
                return Taken(count, run.from_last(then_s))
        share = turning_share(before, following)
        way = Way(following)
        yield from self._follow(way, moves[1:])
        chain = yield from Chain.along(way, share)
        yield
        last = run.last
        now_s, then_s = self._now_and_then(run)
        turning = self._turning(last, chain, way, share, now_s, then_s)
        ending, start_s = yield from at_most(MOST_SLICES, turning)
        run.replace_last(ending)
        if start_s is None:
            return None if ending is last else Taken(0, run.from_last(then_s))
        from_s = run.from_last(start_s if ending is last else then_s)
        run.add(chain, start_s)
        return Taken(1 + len(way.corners), from_s)

    def _turning(
        self, last: Chain, chain: Chain, way: Way, share: float, now_s: float, then_s: float
    ) -> Slices[tuple[Chain, float | None]]:
        """The last chain, the same up to `then_s`, as it should come to rest; and when in its time another,
        planned along a way with this share, may set out meanwhile, None where to stop takes no longer."""
        braking = yield from last.braking(share, now_s, then_s)
        yield
        start_s = yield from set_out_s(braking, chain, then_s, *self._position_limits)
        sure_s = SURE_WINDOWS * (1.0 - share) * last.plan.timing.window_s
        if start_s is not None and last.rest_s - start_s > sure_s:
            return braking, start_s
        yield
        stopping = yield from last.braking_fully(now_s, then_s)
        if start_s is not None:
            yield
            alone = yield from Chain.along(way)
            if start_s + chain.rest_s <= stopping.rest_s + alone.rest_s:
                return braking, start_s
        return stopping, None

    def _now_and_then(self, run: Run) -> tuple[float, float]:
        """Two times in the last chain: now, and from when on a change of it may show."""
        time_s = self._time.time_s
        run.forget(time_s)
        now_s = run.in_last(time_s)
        return now_s, max(run.alone_s(time_s), now_s + self._margin_s)

    def _follow(self, way: Way, moves: list[Move]) -> Slices[None]:
        """Let the way go on round the corners that can be driven round, one in a slice."""
        for move in moves:
            if not _may_blend(way.last, move):
                break
            corner = None
            if move.number != self._sharp:
                corner = rounded(way.last, move, *self._position_limits)
                yield
            if corner is None:
                self._sharp = move.number
                way.end_share = turning_share(way.last, move)
                break
            way.go_on(corner, move)


def _driving(last: Chain, way: Way, now_s: float, then_s: float) -> Slices[tuple[Chain, int]]:
    """The last chain, the same up to `then_s`, driven on along a way, and into how many moves; none where to
    stop is over sooner."""
    driven, count = yield from last.driven_on(way, now_s, then_s)
    # From rest to rest moves take as long as their velocity limits let them, and a window.
    least_s = sum(move.length_s for _, move in way.corners[:count]) + last.plan.timing.window_s
    if driven.rest_s - last.rest_s > least_s:
        yield
        stopping = yield from last.braking_fully(now_s, then_s)
        yield
        alone = yield from Chain.along(way.after_first(count))
        if driven.rest_s > stopping.rest_s + alone.rest_s:
            return last, 0
    return driven, count


def _may_blend(first: Move, second: Move) -> bool:
    return first.zone is not None and second.length_s > 0.0
