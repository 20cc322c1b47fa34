"""The drive: runs moves one after the other, blended where they may be, and stops them on their path."""

from collections import deque

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.look_ahead import LookAhead
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.path import Joints
from iiwa_sim.motion.rate import PlannedTime
from iiwa_sim.motion.run import Run

AHEAD = 128
"""Ticks for which joints are found at once: for a line that costs a third of what one by one does."""


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
        self._look_ahead = LookAhead(time, lowest, highest)
        self._run: Run | None = None
        self._waiting: deque[Move] = deque()
        self._newest = 0
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

    @property
    def goal(self) -> Joints:
        """Where the move under way, or the first that waits, or a stop ends (rad); at rest where it is."""
        if self._run is None:
            return self._waiting[0].path.end if self._waiting else self.joints
        if self._time.stopping:
            return self.rest_after_stop()
        return self._run.goal(self._time.time_s)

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
            self._take(self._look_ahead.step(run, self._waiting))
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
        elif not self._time.even:
            self._ahead.clear()
            self.joints = run.joints(self._time.time_s)
        elif not self._time.standing:
            if not self._ahead:
                times = self._time.ticks(AHEAD)
                joints = run.joints_along(times[times < run.rest_s])
                self._ahead = list(map(tuple, joints[::-1].tolist()))
            self.joints = self._ahead.pop()

    def _begin(self, time_s: float) -> Run:
        """A run that begins with the next moves, begun that long ago."""
        self._run = run = Run(self._look_ahead.first_chain(self._waiting))
        self._ahead.clear()
        self._look_ahead.forget()
        self._time.start(time_s)
        return run

    def _take(self, count: int) -> None:
        """Moves that do not wait any more, since the run has been planned again with them."""
        if count:
            for _ in range(count):
                self._waiting.popleft()
            self._ahead.clear()
