"""The look ahead: plans the chain under way on, into the moves that wait, in slices over ticks."""

from collections import deque
from collections.abc import Sequence
from itertools import islice, pairwise
from math import ceil
from typing import NamedTuple

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.queue.chain import Chain, Front
from iiwa_sim.motion.queue.corner import Corner, corner
from iiwa_sim.motion.queue.course import Course
from iiwa_sim.motion.queue.move import Move
from iiwa_sim.motion.queue.planning import CELL_S, FREE_S, begun, planned, planned_on
from iiwa_sim.motion.rate import PlannedTime
from iiwa_sim.motion.slices import Slices

HORIZON_S = 1.5
"""While less than this of a chain lies ahead, it is planned on into moves that wait,"""
MOST_AT_ONCE = 30
"""so many at once at the most,"""
BATCH_S = 0.5
"""or as many as take about so long."""
SHORT_S = 0.05
"""Where the first move takes less at its full speed, some are planned together before the robot sets out, as
many as take"""
ENOUGH_S = 0.3
"""so long,"""
SHORTEST_S = 0.1
"""or so long, where there are two: waiting for the plan of both would cost more,"""
MOST_AT_FIRST = 12
"""but no more."""
SLICE_S = 0.0025
"""A tick has a slice for each of these that it has begun,"""
MOST_SLICES = 2
"""but no more."""
SLICES = 8
"""What is planned anew takes about so many slices; what is before then is not changed."""
LEAST_MARGIN_S = 0.01
CHANGING_S = 0.15
CELLS_OF_MOVE = 10
"""Of a short move, about; and so many cells are"""
CELLS_IN_SLICE = 10.0
"""planned in a slice, all in all."""
LONG_S = 1.5
"""Longer moves have no more cells."""
MORE_PATIENCE, MOST_PATIENCE = 1.7, 2.0
"""By what more time is taken where a plan came too late."""
LONGEST_S = 0.2
"""A change of a chain shows no later than this."""
LEAST_PACE = 0.02
SHARES = (1.0, 0.6, 0.3)
"""Of a corner, where no clock was found for the whole of it."""
MOST_TRIES = 3
"""To go on into a move, before it is left to set out from rest."""
ROUNDING = 1e-9


class Ahead(NamedTuple):
    """A chain in place of the one under way."""

    chain: Chain
    moves: int
    """So many that waited are part of it."""


class LookAhead:
    """Plans each chain on till it is as fast as it can be, and each move that waits into it, where that may
    be."""

    def __init__(self, time: PlannedTime, lowest: Array, highest: Array) -> None:
        """The limits of joint positions are in rad (n,)."""
        self._time = time
        self._slices = min(ceil(time.tick_s / SLICE_S - ROUNDING), MOST_SLICES)
        self._margin_s = max((SLICES / self._slices + 1.0) * time.tick_s, LEAST_MARGIN_S)
        self._position_limits = lowest, highest
        self.forget()

    def forget(self) -> None:
        """Begin anew: another chain is under way, or other moves wait."""
        self._work: Slices[Ahead | None] | None = None
        self._setting_out: tuple[int, Slices[Ahead | None]] | None = None
        self._faster_tried = False
        self._tries = 0  # to go on into the first move that waits
        self._refused = 0  # the last move that was found to set out from rest

    def begin(self, waiting: deque[Move]) -> Ahead | None:
        """A chain to set out with; None while short moves are planned together, in the slices of ticks."""
        first = waiting[0]
        if first.length_s >= SHORT_S or len(waiting) < 2 or not may_blend(first, waiting[1]):
            return Ahead(begun(first), 1)
        if self._setting_out is None or self._setting_out[0] != first.number:
            alone = begun(first)
            if len(waiting) == 2 and alone.rest_s >= SHORTEST_S:
                return Ahead(alone, 1)
            self._setting_out = first.number, self._first(list(islice(waiting, MOST_AT_FIRST)))
        for _ in range(self._slices):
            try:
                next(self._setting_out[1])
            except StopIteration as end:
                self._setting_out = None
                ahead: Ahead | None = end.value
                # What waits may have been forgotten meanwhile.
                if ahead and all(
                    one is other for one, other in zip(ahead.chain.moves, waiting, strict=False)
                ):
                    return ahead if ahead.moves <= len(waiting) else Ahead(begun(first), 1)
                return Ahead(begun(first), 1)
        return None

    def step(self, chain: Chain, waiting: deque[Move]) -> Ahead | None:
        """The slices of a tick; None while nothing changes."""
        for _ in range(self._slices):
            if self._work is None:
                self._work = self._next(chain, waiting)
                if self._work is None:
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

    @property
    def kept_s(self) -> float:
        """What lies ahead is not to change before: as far as a changing override looks."""
        return CHANGING_S if self._time.changing else 0.0

    def _in_time(self, planned: Chain) -> bool:
        """Whether what a chain changes is still ahead."""
        return planned.front_s > self._time.time_s + self.kept_s

    def _next(self, chain: Chain, waiting: deque[Move]) -> Slices[Ahead | None] | None:
        left_s = chain.rest_s - self._time.time_s
        if (
            waiting
            and left_s < HORIZON_S
            and waiting[0].number != self._refused
            and may_blend(chain.moves[-1], waiting[0])
        ):
            return self._on(chain, list(islice(waiting, MOST_AT_ONCE)))
        if chain.rough and not self._faster_tried:
            self._faster_tried = True
            return self._faster(chain)
        return None

    @property
    def _soonest_s(self) -> float:
        """What lies ahead is kept for so long: till another plan is there, and what may not change."""
        return self._margin_s + self.kept_s

    def _faster(self, chain: Chain) -> Slices[Ahead | None]:
        now_s = self._time.time_s
        faster = yield from planned_on(chain, now_s, now_s + self._soonest_s, [], [])
        if faster is None or faster.rest_s >= chain.rest_s:
            return None
        return Ahead(faster, 0)

    def _first(self, moves: Sequence[Move]) -> Slices[Ahead | None]:
        """A chain of the first moves that wait; None where none was found."""
        corners = yield from self._corners(moves, 1.0, ENOUGH_S)
        for count in sorted({len(corners), 1}, reverse=True) if corners else ():
            chain = yield from planned(Course(moves[: count + 1], corners[:count]), Front.at_start())
            if chain is None:
                continue
            if count > 1:
                return Ahead(chain, count + 1)
            yield
            stopping = [begun(move) for move in moves[:2]]
            if chain.rest_s <= sum(each.rest_s for each in stopping):
                return Ahead(chain, 2)
            return Ahead(stopping[0], 1)
        return None

    def _needed_s(self, chain: Chain, moves: Sequence[Move]) -> float:
        """How long it takes to plan a chain on into so many moves, about; less where so much does not lie
        ahead."""
        now_s = self._time.time_s
        ahead = len(chain.times) - int(chain.times.searchsorted(max(now_s, chain.rest_s - FREE_S)))
        cells = ahead + sum(CELLS_OF_MOVE + min(move.length_s, LONG_S) / CELL_S for move in moves)
        slices = SLICES + cells / CELLS_IN_SLICE
        needed_s = (slices / self._slices + 1.0) * self._time.tick_s
        return max(self._soonest_s, min(needed_s, 0.5 * (chain.rest_s - now_s), LONGEST_S))

    def _corners(self, moves: Sequence[Move], pace: float, enough_s: float) -> Slices[list[Corner]]:
        """Those between moves, until one has to be a stop, or they take long enough at a pace (dx/dt)."""
        corners: list[Corner] = []
        ahead_s = 0.0
        for one, other in pairwise(moves):
            found = corner(one, other, *self._position_limits) if may_blend(one, other) else None
            if found is None or (corners and ahead_s > enough_s):
                break
            corners.append(found)
            ahead_s += other.length_s / pace
            if len(corners) % 4 == 0:
                yield
        return corners

    def _on(self, chain: Chain, moves: Sequence[Move]) -> Slices[Ahead | None]:
        """The chain going on into as many of these moves as may be."""
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
        stopping_s: float | None = None
        for count, share in tries if moves else ():
            first = corners[0]._replace(before=share * corners[0].before, after=share * corners[0].after)
            while True:
                now_s = self._time.time_s
                then_s = now_s + patience * self._needed_s(chain, moves[:count])
                on = yield from planned_on(chain, now_s, then_s, moves[:count], [first, *corners[1:count]])
                if on is None:
                    break
                if self._in_time(on):
                    if count > 1 or on.rest_s - chain.rest_s <= moves[0].length_s:
                        self._tries = 0
                        return Ahead(on, count)
                    if stopping_s is None:
                        stopping_s = yield from self._stopping_s(chain, moves[0])
                    if on.rest_s > stopping_s:
                        self._tries = MOST_TRIES
                        break
                    if self._in_time(on):
                        self._tries = 0
                        return Ahead(on, count)
                elif patience > MOST_PATIENCE:
                    break
                else:
                    patience *= MORE_PATIENCE
        # Later there may be a way: what then can still be changed begins elsewhere.
        self._tries += 1
        if not moves or self._tries >= MOST_TRIES:
            self._refused, self._tries = number, 0
        return None

    def _stopping_s(self, chain: Chain, move: Move) -> Slices[float]:
        """When it would be over to come to rest before a move, and to set out again."""
        yield
        alone_s = begun(move).rest_s
        if not chain.rough:
            return chain.rest_s + alone_s
        yield
        now_s = self._time.time_s
        faster = yield from planned_on(chain, now_s, now_s + self._soonest_s, [], [])
        return min(faster.rest_s if faster else chain.rest_s, chain.rest_s) + alone_s


def may_blend(first: Move, second: Move) -> bool:
    """Whether the robot need not stop between two moves."""
    return first.zone is not None and second.length_s > 0.0
