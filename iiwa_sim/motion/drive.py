"""The drive: runs moves one after the other, tick by tick, and stops them on their path."""

from collections import deque

from iiwa_sim.motion.move import Move
from iiwa_sim.motion.path import Joints
from iiwa_sim.motion.rate import PlannedTime
from iiwa_sim.motion.timing import Timing

AHEAD = 256
"""Ticks for which joints are found at once: for a line that costs a third of what one by one does."""


class Drive:
    """Joint positions (rad) over ticks.

    A move starts in the tick after it is appended, or when those before it have ended, also within a tick.
    """

    _timing: Timing
    """That of the running move."""

    def __init__(self, joints: Joints, time: PlannedTime) -> None:
        """At rest at `joints` (rad)."""
        self.joints = joints
        self.rest = joints
        """Where the robot comes to rest when all moves, or the stop under way, are done (rad)."""
        self._time = time
        self._running: Move | None = None
        self._waiting: deque[Move] = deque()
        self._ahead: list[Joints] = []  # of the coming ticks, the last one first

    @property
    def moving(self) -> bool:
        """Whether a move runs, is being stopped, or waits."""
        return self._running is not None or bool(self._waiting)

    @property
    def waiting(self) -> int:
        """Moves that have not begun."""
        return len(self._waiting)

    def is_pending(self, number: int) -> bool:
        """Whether a move runs, and is not being stopped, or waits."""
        if self._running is not None and self._running.number == number:
            return not self._time.stopping
        return bool(self._waiting) and self._waiting[0].number <= number <= self._waiting[-1].number

    def append(self, move: Move) -> None:
        """Queue a move that begins at `rest`."""
        self.rest = move.path.end
        self._waiting.append(move)

    def rest_after_stop(self) -> Joints:
        """Where the robot would come to rest if it were stopped now (rad)."""
        if self._running is None:
            return self.joints
        return self._running.path.joints(self._timing.position(self._time.rest_s()))

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
        if self._running is None and not self._waiting:
            return
        try:
            self._advance()
        except Exception:
            self._running = None
            self._waiting.clear()
            self.rest = self.joints
            raise

    def _advance(self) -> None:
        move = self._running or self._begin(0.0)
        self._time.step()
        while self._time.time_s >= self._timing.duration_s:
            self.joints = move.path.end
            went_at_once = self._timing.duration_s == 0.0
            left_s = 0.0 if self._time.stopping else self._time.time_s - self._timing.duration_s
            self._running = None
            if not self._waiting or went_at_once:
                return  # one move a tick of those that go at once: many might add up to a jump
            move = self._begin(left_s)
        if self._time.stopping:
            self.joints = move.path.joints(self._timing.position(self._time.time_s))
            if self._time.stopped:
                self._running = None
        else:
            if not self._ahead:
                times = self._time.ticks(AHEAD)
                s = self._timing.positions(times[times < self._timing.duration_s])
                self._ahead = move.path.joints_along(s)[::-1]
            self.joints = self._ahead.pop()

    def _begin(self, time_s: float) -> Move:
        """The next move, begun that long ago."""
        move = self._waiting.popleft()
        self._timing = move.timing()
        self._running = move
        self._ahead.clear()
        self._time.start(time_s)
        return move
