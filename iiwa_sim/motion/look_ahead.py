"""The look ahead: takes the moves that wait into the run under way, so that it goes on without a stop.

A corner that can be driven round without losing speed is; at any other the robot turns at the target. To plan
that costs a few milliseconds, so it is done in slices, one in a tick.
"""

from collections import deque
from collections.abc import Iterator
from itertools import islice

from iiwa_sim.motion.chain import Chain, Way
from iiwa_sim.motion.corner import rounded, turning_share
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.overlap import set_out_s
from iiwa_sim.motion.rate import PlannedTime
from iiwa_sim.motion.run import Run

LOOK_AHEAD_S = 1.0
"""While less than this of a run is planned, moves that wait are taken into it."""
MOST_AT_ONCE = 6
"""So many: what a chain costs to plan grows with them."""
ENOUGH_S = 0.25
"""A run begins with moves that take at least so long, if it can."""
MARGIN_TICKS = 2
"""A plan that is made in two ticks changes nothing before the third."""


class LookAhead:
    """Looks at each move that waits once."""

    def __init__(self, time: PlannedTime, lowest: Array, highest: Array) -> None:
        """The limits of joint positions are in rad (n,)."""
        self._time = time
        self._margin_s = MARGIN_TICKS * time.tick_s
        self._position_limits = lowest, highest
        self._looked_at = 0  # the number of the last move looked at
        self._sharp = 0  # that of the last move that a sharp corner was found before
        self._look: Iterator[int] | None = None

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
        while way.length_s < ENOUGH_S and next(slices, None) is not None:
            pass
        for _ in range(1 + len(way.corners)):
            waiting.popleft()
        return Chain(way)

    def step(self, run: Run, waiting: deque[Move]) -> int:
        """One slice. Gives how many of the moves that wait it has taken into the run."""
        if self._look is None:
            if not waiting or run.rest_s - self._time.time_s > LOOK_AHEAD_S:
                return 0
            following = waiting[0]
            if following.number == self._looked_at or not _may_blend(run.last.moves[-1], following):
                return 0
            self._looked_at = following.number
            self._look = self._slices(run, list(islice(waiting, MOST_AT_ONCE)))
        taken = next(self._look, None)
        if taken is None:
            self._look = None
        return taken or 0

    def _slices(self, run: Run, moves: list[Move]) -> Iterator[int]:
        last, following = run.last, moves[0]
        way = Way(last.moves[-1])
        yield from self._follow(way, moves)
        if way.corners:
            run.forget(self._time.time_s)
            taken = last.drive_on(way, run.in_last(self._time.time_s), run.alone_s(self._time.time_s))
            yield taken
            if taken:
                return
        before = last.moves[-1]
        share = turning_share(before, following)
        way = Way(following)
        yield from self._follow(way, moves[1:])
        chain = Chain(way, share)
        yield 0
        run.forget(self._time.time_s)
        now_s = run.in_last(self._time.time_s)
        braking = last.braking(share, now_s, run.alone_s(self._time.time_s) + self._margin_s)
        yield 0
        as_planned = last.plan
        last.plan = braking
        start_s = set_out_s(last, chain, run.alone_s(self._time.time_s), *self._position_limits)
        if start_s is None or start_s + chain.lost_s > as_planned.timing.rest_s:
            last.plan = as_planned  # there is nothing to overlap, or to stop takes no longer
            return
        run.add(chain, start_s)
        yield 1 + len(way.corners)

    def _follow(self, way: Way, moves: list[Move]) -> Iterator[int]:
        """Let the way go on round the corners that can be driven round, one in a slice."""
        for move in moves:
            if not _may_blend(way.last, move):
                break
            corner = None
            if move.number != self._sharp:
                corner = rounded(way.last, move, *self._position_limits)
            if corner is None:
                self._sharp = move.number
                way.end_share = turning_share(way.last, move)
                break
            way.go_on(corner, move)
            yield 0


def _may_blend(first: Move, second: Move) -> bool:
    return first.zone is not None and second.length_s > 0.0
