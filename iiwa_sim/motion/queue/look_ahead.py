"""The look ahead: extends the chain under way into the moves that wait, in slices over ticks."""

from collections import deque
from collections.abc import Sequence
from itertools import islice, pairwise
from math import ceil

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.queue.alone import alone_s, at_least_s, may_be_slower, slower
from iiwa_sim.motion.queue.chain import Ahead, Chain, Front
from iiwa_sim.motion.queue.corner import Corner, corner, may_blend
from iiwa_sim.motion.queue.course import Course
from iiwa_sim.motion.queue.move import Move
from iiwa_sim.motion.queue.planning import FREE_S, begun, planned, planned_on
from iiwa_sim.motion.queue.setting_out import MOST_AT_FIRST, SHORT_S, SettingOut, are_short
from iiwa_sim.motion.slices import Slices
from iiwa_sim.motion.time_scaling import TimeScaling

HORIZON_S = 1.0
"""A chain is planned on into moves that wait once less than this lies ahead."""
MOST_AT_ONCE = 30
"""The most moves it is planned on into at once."""
BATCH_S = 4.0
"""Fewer are taken where these take about so long."""
ENOUGH_S = 0.3
"""Short moves are planned together until they take this long, or are `MOST_AT_FIRST`."""
MOST_WAIT_S = 0.1
"""The longest that the robot waits for short moves to be planned."""
WORTH_WAITING = 0.5
"""Part of the time that planning short moves together can gain, longer than which the robot does not wait."""
SHORTEST_S = 0.08
"""A chain that takes less is not planned on into short moves: they are planned together while it runs. For
two moves, the first of which takes more alone, the robot does not wait at all."""
SLICE_S = 0.0025
"""A tick computes one slice for each of these that it has begun, and `MOST_SLICES` at the most."""
MOST_SLICES = 2
SLICES = 7
"""A plan of few cells takes about so many slices. What the robot does until then is not changed by it."""
LEAST_MARGIN_S = 0.01
CELL_S = 0.01
CELLS_OF_MOVE = 10
"""About how many cells a short move has."""
CELLS_IN_SLICE = 20.0
"""About how many cells of a plan a slice computes."""
LONG_S = 1.5
"""A longer move has no more cells than one of this length."""
MORE_PATIENCE, MOST_PATIENCE = 1.7, 2.0
"""Where a plan came too late, the next try is given so many times more time, until that is more than so many
times the first."""
LONGEST_S = 0.2
"""A change of a chain begins no later than this after now."""
LEAST_PACE = 0.02
SHARES = (1.0, 0.6)
"""Parts of a corner that are tried one after the other, until a clock is found."""
ROUNDING = 1e-9


class LookAhead:
    """Makes a chain as fast as it can be while it runs, and extends it into moves that wait where it may
    blend into them."""

    def __init__(self, time: TimeScaling, lowest: Array, highest: Array) -> None:
        """`lowest` and `highest` are the position limits (n,), in rad."""
        self._time = time
        self._slices = min(ceil(time.tick_s / SLICE_S - ROUNDING), MOST_SLICES)
        self._margin_s = max((SLICES / self._slices + 1.0) * time.tick_s, LEAST_MARGIN_S)
        self._position_limits = lowest, highest
        self.forget()

    def forget(self) -> None:
        """Begin anew: another chain is under way, or other moves wait."""
        self._work: Slices[Ahead | None] | None = None
        self._setting_out: SettingOut | None = None
        self._waits_s = 0.0  # so long at the most for what sets out
        self._faster_tried = False
        self._refused = 0  # number of the last move that is left to set out from rest
        self.quiet_until_s = 0.0
        """Until this planned time `step` has nothing to do, with the same chain and the same moves."""

    def begin(self, waiting: deque[Move]) -> Ahead | None:
        """A chain to set out with from rest; None while short moves are still being planned together."""
        first = waiting[0]
        if len(waiting) < 2 or not are_short(waiting):
            return Ahead(begun(first), 1)
        setting_out = self._setting_out
        if setting_out is None or setting_out.number != first.number:
            if len(waiting) == 2 and (alone := begun(first)).rest_s >= SHORTEST_S:
                return Ahead(alone, 1)
            setting_out = self._set_out(waiting)
        setting_out.go_on(self._slices)
        self._waits_s -= self._time.tick_s
        if not setting_out.over and self._waits_s > 0.0:
            return None
        ahead = setting_out.ahead
        # What waits may have been forgotten meanwhile.
        if (
            ahead is None
            or ahead.moves > len(waiting)
            or any(one is not other for one, other in zip(ahead.chain.moves, waiting, strict=False))
        ):
            return Ahead(begun(first), 1)
        return ahead

    def step(self, chain: Chain, waiting: deque[Move]) -> Ahead | None:
        """Plan for a tick. Gives a chain that replaces `chain`; None while that stays."""
        self.quiet_until_s = 0.0
        refused = bool(waiting) and waiting[0].number == self._refused
        if (refused or chain.rest_s < SHORTEST_S) and len(waiting) > 1 and are_short(waiting):
            self._set_out(waiting).go_on(self._slices)
            return None
        for _ in range(self._slices):
            if self._work is None:
                self._work = self._next(chain, waiting)
                if self._work is None:
                    on = self._may_go_on(chain, waiting)
                    self.quiet_until_s = chain.rest_s - HORIZON_S if on else chain.rest_s
                    return None
            try:
                next(self._work)
            except StopIteration as end:
                self._work = None
                ahead: Ahead | None = end.value
                # Comparing with a stop takes slices, too, and an override may have begun to change.
                if ahead is None or self._in_time(ahead.chain):
                    return ahead
                self._faster_tried = False
                return None
        return None

    def _set_out(self, waiting: deque[Move]) -> SettingOut:
        """The plan, begun or under way, of short moves that set out with the first of `waiting`."""
        if self._setting_out is None or self._setting_out.number != waiting[0].number:
            moves = list(islice(waiting, MOST_AT_FIRST))
            self._setting_out = SettingOut(moves[0].number, self._first(moves))
            # The most that leaving out all stops between short moves can save.
            gain_s = sum(alone_s(move) for move in moves if move.length_s < SHORT_S)
            self._waits_s = min(WORTH_WAITING * gain_s, MOST_WAIT_S)
        return self._setting_out

    def _in_time(self, planned: Chain) -> bool:
        """Whether the front of a chain is still ahead, so that it can replace the one under way."""
        return planned.front_s > self._time.time_s

    def _next(self, chain: Chain, waiting: deque[Move]) -> Slices[Ahead | None] | None:
        if chain.rest_s - self._time.time_s < HORIZON_S and self._may_go_on(chain, waiting):
            return self._on(chain, list(islice(waiting, MOST_AT_ONCE)))
        if chain.rough and not self._faster_tried:
            self._faster_tried = True
            return self._faster(chain)
        return None

    def _may_go_on(self, chain: Chain, waiting: deque[Move]) -> bool:
        """Whether a chain may be planned on into what waits."""
        return bool(waiting) and waiting[0].number != self._refused and may_blend(chain.moves[-1], waiting[0])

    def _faster(self, chain: Chain) -> Slices[Ahead | None]:
        now_s = self._time.time_s
        faster = yield from planned_on(chain, now_s, now_s + self._needed_s(chain, []), [], [])
        if faster is None or faster.rest_s >= chain.rest_s:
            return None
        return Ahead(faster, 0)

    def _first(self, moves: Sequence[Move]) -> Slices[Ahead | None]:
        """A chain from rest along the first of `moves`; None where none was found."""
        corners = yield from self._corners(moves, 1.0, ENOUGH_S)
        for count in sorted({len(corners), 1}, reverse=True) if corners else ():
            chain = yield from planned(Course(moves[: count + 1], corners[:count]), Front.at_start())
            if chain is not None and not (yield from slower(chain.rest_s, moves[: count + 1])):
                return Ahead(chain, count + 1)
        return None

    def _needed_s(self, chain: Chain, moves: Sequence[Move]) -> float:
        """The time (s), about, that it takes to extend a chain into `moves`; less where it ends before."""
        now_s = self._time.time_s
        ahead = len(chain.times) - int(chain.times.searchsorted(max(now_s, chain.rest_s - 2.0 * FREE_S)))
        cells = ahead + sum(CELLS_OF_MOVE + min(move.length_s, LONG_S) / CELL_S for move in moves)
        slices = SLICES + cells / CELLS_IN_SLICE
        needed_s = (slices / self._slices + 1.0) * self._time.tick_s
        return max(self._margin_s, min(needed_s, 0.5 * (chain.rest_s - now_s), LONGEST_S))

    def _corners(self, moves: Sequence[Move], pace: float, enough_s: float) -> Slices[list[Corner]]:
        """Corners between moves, until one has to be a stop, or they take long enough at a pace (dx/dt)."""
        corners: list[Corner] = []
        ahead_s = 0.0
        for one, other in pairwise(moves):
            found = corner(one, other, *self._position_limits) if may_blend(one, other) else None
            if found is None or (corners and ahead_s > enough_s):
                break
            corners.append(found)
            ahead_s += other.length_s / pace
            if len(corners) % 2 == 0:
                yield
        return corners

    def _on(self, chain: Chain, moves: Sequence[Move]) -> Slices[Ahead | None]:
        """The chain extended into as many of `moves` as possible; None where that fails."""
        number = moves[0].number
        now_s = self._time.time_s
        pace = min(
            max((chain.course.end_x - chain.x(now_s)) / max(chain.rest_s - now_s, 1e-3), LEAST_PACE), 1.0
        )
        corners = yield from self._corners([chain.moves[-1], *moves], pace, BATCH_S)
        moves = moves[: len(corners)]
        tries = [(len(moves), share) for share in SHARES]
        if len(moves) > 1:
            tries.insert(2, (1, 1.0))
        patience = 1.0
        rests_s: float | None = None
        for count, share in tries if moves else ():
            first = corners[0]._replace(before=share * corners[0].before, after=share * corners[0].after)
            while True:
                now_s = self._time.time_s
                then_s = now_s + patience * self._needed_s(chain, moves[:count])
                on = yield from planned_on(chain, now_s, then_s, moves[:count], [first, *corners[1:count]])
                if on is None:
                    break
                if self._in_time(on):
                    if may_be_slower(on.rest_s - at_least_s(chain), moves[:count]):
                        if rests_s is None:
                            rests_s = yield from self._rests_s(chain)
                        if (yield from slower(on.rest_s - rests_s, moves[:count])):
                            break
                    if self._in_time(on):
                        return Ahead(on, count)
                elif patience > MOST_PATIENCE:
                    break
                else:
                    patience *= MORE_PATIENCE
        self._refused = number
        return None

    def _rests_s(self, chain: Chain) -> Slices[float]:
        """When the chain under way ends (s), once it is as fast as it can be."""
        if not chain.rough:
            return chain.rest_s
        yield
        now_s = self._time.time_s
        faster = yield from planned_on(chain, now_s, now_s + self._margin_s, [], [])
        return min(faster.rest_s, chain.rest_s) if faster else chain.rest_s
