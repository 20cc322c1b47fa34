"""The drive: runs moves one after the other, blended where they may be, and stops them on their path."""

from collections import deque
from itertools import islice
from math import inf

from iiwa_sim.motion.chain import Chain, Plan
from iiwa_sim.motion.corner import turning_share
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.overlap import set_out_s
from iiwa_sim.motion.path import Joints
from iiwa_sim.motion.rate import PlannedTime
from iiwa_sim.motion.run import Run

AHEAD = 128
"""Ticks for which joints are found at once: for a line that costs a third of what one by one does."""
LOOK_AHEAD_S = 1.0
"""While less than this of a chain is planned, moves that wait are taken into it."""
PAUSE_S = 0.006
"""A look at a corner, which costs some milliseconds, is followed by none for so long,"""
LONGER_PAUSE = 0.3
"""or where it found nothing for this part of the time that is left."""
PATIENCE_S = 0.01
"""A corner is passed at speed unless a stop saves more than this."""
MOST_AT_ONCE = 6
"""So many in a tick, which costs a few milliseconds."""


class Drive:
    """Joint positions (rad) over ticks.

    A move starts in the tick after it is appended, or when those before it have ended, also within a tick.
    """

    def __init__(self, joints: Joints, time: PlannedTime, lowest: Array, highest: Array) -> None:
        """At rest at `joints` (rad), with the limits of positions (n,)."""
        self.joints = joints
        self.rest = joints
        """Where the robot comes to rest when all moves, or the stop under way, are done (rad)."""
        self._time = time
        self._position_limits = lowest, highest
        self._run: Run | None = None
        self._waiting: deque[Move] = deque()
        self._newest = 0
        self._looked_at = 0  # the number of the last move that was tried to blend,
        self._look_again_s = 0.0  # and when it is tried again
        self._ahead: list[Joints] = []  # of the coming ticks, the last one first

    @property
    def moving(self) -> bool:
        """Whether a move runs, is being stopped, or waits."""
        return self._run is not None or bool(self._waiting)

    @property
    def waiting(self) -> int:
        """Moves that have not begun."""
        if self._run is None or self._time.stopping:
            return len(self._waiting)
        return len(self._waiting) + self._run.waiting(self._time.time_s)

    def is_pending(self, number: int) -> bool:
        """Whether a move runs, and is not being stopped, or waits."""
        if self._run is None or self._time.stopping:
            return bool(self._waiting) and self._waiting[0].number <= number <= self._newest
        return self._run.move_at(self._time.time_s) <= number <= self._newest

    def append(self, move: Move) -> None:
        """Queue a move that begins at `rest`."""
        self.rest = move.path.end
        self._newest = move.number
        self._waiting.append(move)

    def rest_after_stop(self) -> Joints:
        """Where the robot would come to rest if it were stopped now (rad)."""
        if self._run is None:
            return self.joints
        return self._run.joints(self._time.rest_s())

    def stop(self) -> None:
        """Stop on the path, and forget the moves that wait."""
        self._waiting.clear()
        self._time.stop()
        self.rest = self.rest_after_stop()

    def start_from(self, joints: Joints) -> None:
        """Be at rest at other joint positions (rad): something else has moved the robot, or will have."""
        self.joints = self.rest = joints

    def step(self) -> None:
        """One tick.

        Where a path fails, the robot rests where it is, the moves that wait are forgotten, and what the path
        raised is raised.
        """
        if self._run is None and not self._waiting:
            return
        try:
            self._advance()
        except Exception:
            self._run = None
            self._waiting.clear()
            self.rest = self.joints
            raise

    def _advance(self) -> None:
        if self._run is None and self._waiting[0].length_s == 0.0:
            # One move a tick of those that have no way to go: many might add up to a jump.
            self.joints = self._waiting.popleft().path.end
            return
        run = self._run or self._begin(0.0)
        if not self._time.stopping:
            self._look_ahead(run)
        self._time.step()
        while self._time.time_s >= run.rest_s:
            self.joints = run.last.end
            left_s = 0.0 if self._time.stopping else self._time.time_s - run.rest_s
            self._run = None
            if not self._waiting or self._waiting[0].length_s == 0.0:
                return
            run = self._begin(left_s)
        if self._time.stopping:
            self.joints = run.joints(self._time.time_s)
            if self._time.stopped:
                self._run = None
        else:
            if not self._ahead:
                times = self._time.ticks(AHEAD)
                self._ahead = run.joints_along(times[times < run.rest_s])[::-1]
            self.joints = self._ahead.pop()

    def _begin(self, time_s: float) -> Run:
        """A run that begins with the next moves, begun that long ago."""
        self._run = run = Run(self._next_chain())
        self._ahead.clear()
        self._look_again_s = 0.0
        self._time.start(time_s)
        return run

    def _next_chain(self) -> Chain:
        """As many of the moves that wait as make a chain."""
        move = self._waiting.popleft()
        chain = Chain(move, self._next_moves(), *self._position_limits)
        for _ in range(chain.taken - 1):
            self._waiting.popleft()
        return chain

    def _look_ahead(self, run: Run) -> None:
        """Let a move that waits blend into the last one that is planned, while it can."""
        time_s = self._time.time_s
        if not self._waiting or time_s < self._look_again_s or run.rest_s - time_s > LOOK_AHEAD_S:
            return
        following, last = self._waiting[0], run.last
        if last.moves[-1].zone is None or following.length_s == 0.0:
            return
        run.forget(time_s)
        now_s, alone_s = run.in_last(time_s), run.alone_s(time_s)
        driven = last.driven_on(self._next_moves(), now_s, alone_s)
        if driven is not None and driven.geometry.steady:
            self._drive_on(last, driven)
            return
        # To drive round the corner, or to turn at the target: what is over sooner?
        first_look, self._looked_at = following.number != self._looked_at, following.number
        self._look_again_s = time_s + PAUSE_S
        as_planned, stopping_s = last.plan, last.rest_s
        share = turning_share(last.moves[-1], following)
        chain = Chain(following, [], *self._position_limits, share)
        start_s = None
        if first_look:
            last.brake_with(share, now_s, alone_s)
            start_s = set_out_s(last, chain, alone_s, *self._position_limits)
        turned_s = inf if start_s is None else start_s + chain.rest_s
        driven_s = inf if driven is None else driven.timing.rest_s
        alone = chain if share == 1.0 else Chain(following, [], *self._position_limits)
        if min(turned_s, driven_s) > stopping_s + alone.rest_s + PATIENCE_S:
            self._look_again_s = time_s + LONGER_PAUSE * (stopping_s - now_s)
            last.plan = as_planned  # to stop costs less than either
        elif driven is not None and driven_s <= turned_s:
            last.plan = as_planned
            self._drive_on(last, driven)
        elif start_s is not None:
            run.add(chain, start_s)
            self._take(1)

    def _drive_on(self, last: Chain, driven: Plan) -> None:
        number = last.moves[-1].number
        last.plan = driven
        self._take(last.moves[-1].number - number)

    def _take(self, count: int) -> None:
        for _ in range(count):
            self._waiting.popleft()
        self._ahead.clear()

    def _next_moves(self) -> list[Move]:
        return list(islice(self._waiting, MOST_AT_ONCE))
