"""The drive: runs planned moves one after the other, tick by tick, and stops them on their path."""

from collections import deque

from iiwa_sim.motion.move import PlannedMove
from iiwa_sim.motion.path import Joints
from iiwa_sim.motion.rate import PlannedTime


class Drive:
    """Joint positions (rad) over ticks.

    A move starts when it is appended, or when those before it have ended, also within a tick.
    """

    def __init__(self, joints: Joints, time: PlannedTime) -> None:
        """At rest at `joints` (rad)."""
        self.joints = joints
        self.rest = joints
        """Where the robot comes to rest when all that is planned, or the stop under way, is done (rad)."""
        self._time = time
        self._running: PlannedMove | None = None
        self._waiting: deque[PlannedMove] = deque()

    @property
    def moving(self) -> bool:
        """Whether a move runs or is being stopped."""
        return self._running is not None

    @property
    def waiting(self) -> int:
        """Moves that have not begun."""
        return len(self._waiting)

    def is_pending(self, number: int) -> bool:
        """Whether a move runs, and is not being stopped, or waits."""
        if self._running is not None and self._running.number == number:
            return not self._time.stopping
        return bool(self._waiting) and self._waiting[0].number <= number <= self._waiting[-1].number

    def append(self, move: PlannedMove) -> None:
        """Queue a move that begins at `rest`."""
        self.rest = move.path.end
        if self._running is None:
            self._begin(move, 0.0)
        else:
            self._waiting.append(move)

    def stop(self) -> None:
        """Stop on the path, and forget the moves that wait."""
        self._waiting.clear()
        move = self._running
        if move is None:
            return
        if self._time.time_s == 0.0:
            self._running = None  # not off yet
            self.rest = self.joints
        else:
            self.rest = move.path.joints(move.timing.position(self._time.stop()))

    def step(self) -> None:
        """One tick.

        Where a path fails, the robot rests where it is, the moves that wait are forgotten, and what the path
        raised is raised.
        """
        if self._running is None:
            return
        try:
            self._advance(self._running)
        except Exception:
            self._running = None
            self._waiting.clear()
            self.rest = self.joints
            raise

    def _advance(self, move: PlannedMove) -> None:
        self._time.step()
        time_s = self._time.time_s
        while time_s >= move.timing.duration_s:
            self.joints = move.path.end
            if not self._waiting:
                self._running = None
                return
            went_at_once = move.timing.duration_s == 0.0
            left_s = 0.0 if self._time.stopping or went_at_once else time_s - move.timing.duration_s
            move, time_s = self._waiting.popleft(), left_s
            self._begin(move, time_s)
            if went_at_once:
                return  # one such step a tick: many might add up to a jump
        self.joints = move.path.joints(move.timing.position(time_s))
        if self._time.stopped:
            self._running = None
            if self._waiting:
                self._begin(self._waiting.popleft(), 0.0)

    def _begin(self, move: PlannedMove, time_s: float) -> None:
        self._running = move
        self._time.start(time_s)
