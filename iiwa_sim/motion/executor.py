"""The executor runs queued moves, blended where possible, or a servo's trajectory, and stops on the path."""

from bisect import bisect_left
from collections import deque
from collections.abc import Sequence
from itertools import islice
from operator import attrgetter

from iiwa_sim.motion.blend import Move
from iiwa_sim.motion.joint_trajectory import JointTrajectory
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.lookahead import MOST_AT_ONCE, LookAhead
from iiwa_sim.motion.ruckig_trajectory import RuckigTrajectory, State
from iiwa_sim.motion.time_scaling import TimeScaling
from iiwa_sim.motion.trajectory import Trajectory, ending

AHEAD = 256
"""Ticks for which joint positions are computed at once: for a line at a sixth of the cost of single ones."""
SAME_RAD = 1e-10
"""A waiting move that was planned from within this distance of where it begins is not planned again."""
_number = attrgetter("number")


class Executor:
    """Joint positions (rad) over ticks, along one trajectory at a time.

    A move starts when the motion before it has ended, also within a tick. From rest it starts in the tick
    after it is appended, or a few ticks later if its plan takes longer. After a cancel the waiting moves are
    planned again from the place of rest, one in each tick, as far as their start differs. If one of them is
    impossible from there, it is dropped with those behind it.
    """

    def __init__(self, joints: Joints, time: TimeScaling, lowest: Array, highest: Array) -> None:
        """The robot rests at `joints` (rad), with the limits of positions (n,)."""
        self.joints = joints
        self.rest = joints
        """Joint positions (rad) after all moves, or after a stop in progress: the next move begins there."""
        self.time = time
        self.trajectory: Trajectory | JointTrajectory | RuckigTrajectory | None = None
        """The trajectory that the robot follows; None at rest."""
        self._queued: Trajectory | None = None  # the trajectory, if it is of queued moves
        self._waiting = deque[Move]()
        self._stale = 0  # so many of these, the last ones, may begin elsewhere than planned
        self._look_ahead = LookAhead(time, lowest, highest)
        self._ahead: list[Joints] = []  # joint positions of coming ticks, the last one first
        self._quiet_until_s = 0.0  # until this planned time ticks only go on to joint positions known ahead

    @property
    def moving(self) -> bool:
        """True if a motion runs, is being stopped, or waits."""
        return self.trajectory is not None or bool(self._waiting)

    @property
    def stopping(self) -> bool:
        """True if a motion is being stopped."""
        return self.trajectory is not None and self.time.stopping

    @property
    def waiting(self) -> int:
        """Number of moves that have not begun."""
        return len(self._waiting) + max(len(self._begun) - 1, 0)

    @property
    def behind(self) -> int:
        """Number of moves behind the one that runs, or begins in the next tick."""
        waiting = self.waiting
        return waiting - 1 if waiting and self.trajectory is None else waiting

    @property
    def under_way(self) -> int:
        """The number of the move that runs and is not being stopped, 0 where there is none."""
        if self._queued is None or self.time.stopping:
            return 0
        return self._queued.move_at(self.time.time_s).number

    @property
    def moves(self) -> list[Move]:
        """The move that runs, unless it is being stopped, and those behind it, in their order."""
        return [*self._begun, *self._waiting]

    @property
    def _begun(self) -> Sequence[Move]:
        if self._queued is None or self.time.stopping:
            return ()
        return self._queued.moves_from(self.time.time_s)

    @property
    def goal(self) -> Joints:
        """End (rad) of the running move, the first waiting one, or a stop; the present position at rest."""
        if self.trajectory is None:
            return self._waiting[0].path.end if self._waiting else self.joints
        if self.time.stopping:
            return self.rest_after_stop()
        return self.rest if self._queued is None else self._queued.move_at(self.time.time_s).path.end

    @property
    def state(self) -> State:
        """Position of the robot, and its derivatives by planned time."""
        if self.trajectory is not None:
            return self.trajectory.state(self.time.time_s)
        still = (0.0,) * len(self.joints)
        return self.joints, still, still

    @property
    def coming(self) -> Joints:
        """Joints after the next tick (rad) without a new request."""
        if self._ahead:
            return self._ahead[-1]
        return self.joints if self.trajectory is None else self.trajectory.joints(self.time.coming_s)

    def is_pending(self, number: int) -> bool:
        """Return True if a move runs, and is not being stopped, or waits."""
        begun = self._begun
        moves = begun if begun and number <= begun[-1].number else self._waiting
        k = bisect_left(moves, number, key=_number)
        return k < len(moves) and moves[k].number == number

    def set_override(self, value: float) -> None:
        """Run present and later motions at this rate (0..1): as soon as limits allow, at rest at once."""
        self._forget_ahead()
        self.time.set_override(value)
        if self.trajectory is None:
            self.time.end()

    def rest_at(self, joints: Joints) -> None:
        """Be at rest at joint positions (rad), with nothing that waits."""
        self._end()
        self._waiting.clear()
        self.joints = self.rest = joints

    def append(self, move: Move) -> None:
        """Queue a move that begins at `rest`."""
        self.rest = move.path.end
        self._waiting.append(move)
        if self._stale:
            self._stale += 1
        self._quiet_until_s = 0.0

    def follow(self, trajectory: JointTrajectory | RuckigTrajectory) -> None:
        """Go along a trajectory that begins with the robot's state, in place of running and waiting moves."""
        if self.trajectory is None:
            self.time.begin()
        else:
            self.time.restart()
        self.trajectory, self._queued = trajectory, None
        self._waiting.clear()
        self._forget_ahead()
        self.rest = trajectory.end

    def rest_after_stop(self) -> Joints:
        """Place of rest after a stop now (rad)."""
        return self.joints if self.trajectory is None else self.trajectory.joints(self.time.rest_s())

    def stop(self) -> None:
        """Stop on the path, and drop the waiting moves."""
        self._waiting.clear()
        self._slow_down()
        self.rest = self.rest_after_stop()

    def cancel(self) -> None:
        """Stop the move that runs, or begins in the next tick, on its path; then run the one behind it.

        Moves that it was blended into are done if the robot passes their targets while it brakes. During a
        stop no move runs, and nothing changes.
        """
        if self.stopping:
            return
        if (queued := self._queued) is not None:
            cancelled = self.under_way
            self._slow_down()
            resumed = max(queued.move_at(self.time.rest_s()).number, cancelled + 1)
            self._waiting.extendleft(move for move in reversed(queued.moves) if move.number >= resumed)
        elif self._waiting:
            self._waiting.popleft()
        self._stale = len(self._waiting)
        self._look_ahead.forget()
        self.rest = self._waiting[-1].path.end if self._waiting else self._planned_end()

    def clear(self) -> None:
        """Drop the moves behind the one that runs, or begins in the next tick, which ends at its target.

        If it has begun to blend into the next move, or is too fast to rest at its target, the robot stops on
        its path.
        """
        queued, kept = self._queued, list[Move]()
        if self.trajectory is None:
            kept = self.moves[:1]
        elif queued is not None and not self.time.stopping:
            if queued.moves[-1].number > self.under_way:
                shorter = ending(queued, self.time.time_s)
                if shorter is None:
                    self._slow_down()
                else:
                    self._go_along(shorter)
            self._forget_ahead()
            self._look_ahead.forget()
        self._waiting, self._stale = deque(kept), len(kept)
        self.rest = kept[0].path.end if kept else self._planned_end()

    def step_quietly(self) -> bool:
        """Make one tick if all it takes is to go on to joint positions known ahead; else return False."""
        time = self.time
        if not self._ahead or time.time_s >= self._quiet_until_s:
            return False
        time.time_s += time.advance_s
        self.joints = self._ahead.pop()
        return True

    def go_on(self, ticks: int) -> None:
        """Make ticks of those that are `ahead`."""
        for _ in range(ticks):
            self.time.time_s += self.time.advance_s
        self.joints = self._ahead[-ticks]
        del self._ahead[-ticks:]

    def ahead(self, ticks: int) -> Sequence[Joints]:
        """Return the joint positions to which a last move will `step_quietly`, at most so many."""
        time, queued = self.time, self._queued
        if queued is None or len(queued.moves_from(time.time_s)) > 1:
            return ()
        return self._ahead[: -1 - min(ticks, time.ticks_until(self._quiet_until_s)) : -1]

    def step(self) -> None:
        """Make one tick. If a path fails, raise its exception, with the robot at rest and nothing waiting."""
        if self.step_quietly():
            return
        try:
            self._advance()
        except Exception:
            self.rest_at(self.joints)
            raise

    def _advance(self) -> None:
        """Make one tick: begin a move that waits or look ahead, advance planned time, and sample there.

        Ends of motions within the tick are passed. Joint positions come `AHEAD` ticks at a time.
        """
        time = self.time
        self._stale = min(self._stale, len(self._waiting))
        if self._stale:
            self._plan_again()
        if self.trajectory is None:
            if not self._begin(0.0):  # it costs as much as a look ahead, so it waits for the next tick
                if self._waiting and self._waiting[0].length_s == 0.0:  # one in each tick
                    self.joints = self._waiting.popleft().path.end
                return
        elif (queued := self._queued) is not None and self._may_look_ahead():
            extended = self._look_ahead.step(queued, self._ready)
            if extended is not None:
                self._go_along(extended)
                del self._ahead[: max(len(self._ahead) - time.ticks_until(extended.front_s), 0)]
            self._quiet_until_s = self._look_ahead.quiet_until_s
        changes = time.changing
        time.step()
        while (trajectory := self.trajectory) is not None and time.time_s >= trajectory.end_s:
            self.joints = trajectory.end
            left_s = 0.0 if changes else time.time_s - trajectory.end_s
            self._end()
            if not self._begin(left_s):
                return
        assert trajectory is not None
        if changes or isinstance(trajectory, RuckigTrajectory):
            self.joints = trajectory.joints(time.time_s)
            if time.stopping and not time.changing:
                self._end()
        elif not time.pausing:
            if not self._ahead:
                times = time.ticks(AHEAD)
                joints = trajectory.sample(times[times < trajectory.end_s])
                self._ahead = list(zip(*joints[::-1].T.tolist(), strict=True))
                if self._queued is None:
                    self._quiet_until_s = trajectory.end_s
            self.joints = self._ahead.pop()

    def _plan_again(self) -> None:
        """Plan the next move that may begin elsewhere, unless its start has not changed; then none has.

        If it cannot begin there, drop it and all behind it.
        """
        self._quiet_until_s = 0.0
        k = len(self._waiting) - self._stale
        start = self._waiting[k - 1].path.end if k else self._planned_end()
        move = self._waiting[k]
        if all(abs(a - b) <= SAME_RAD for a, b in zip(move.path.start, start, strict=True)):
            self._stale = 0
            return
        again = move.again(start)
        if again is None:
            self._waiting, self._stale = deque(islice(self._waiting, k)), 0
            self.rest = start
        else:
            self._waiting[k] = again
            self._stale -= 1
            self.rest = self._waiting[-1].path.end

    @property
    def _ready(self) -> list[Move]:
        """The first of the waiting moves, which begin where they are planned to."""
        return list(islice(self._waiting, min(len(self._waiting) - self._stale, MOST_AT_ONCE)))

    def _begin(self, time_s: float) -> bool:
        """Begin the next move so long ago, at full rate; return False if there is none, or no plan yet."""
        ready = self._ready
        trajectory = self._look_ahead.begin(ready) if ready and ready[0].length_s else None
        if trajectory is None:
            return False
        self._go_along(trajectory)
        self._forget_ahead()
        self._look_ahead.forget()
        self.time.begin(time_s)
        return True

    def _go_along(self, trajectory: Trajectory) -> None:
        """Run a trajectory of queued moves, which do not wait any more."""
        while self._waiting and self._waiting[0].number <= trajectory.moves[-1].number:
            self._waiting.popleft()
        self.trajectory = self._queued = trajectory
        self._quiet_until_s = 0.0

    def _may_look_ahead(self) -> bool:
        """Return True if this tick has time for it: it does not compute joint positions ahead.

        While the override falls, waiting moves do not start: they would start faster than requested.
        """
        time = self.time
        if time.stopping or time.falling:
            return False
        return bool(self._ahead) or time.changing or time.pausing

    def _slow_down(self) -> None:
        """Begin a stop on the trajectory, if there is one."""
        if self.trajectory is not None:
            self._forget_ahead()
            self.time.stop()

    def _end(self) -> None:
        """Leave the trajectory, at its end or after a stop."""
        self.trajectory = self._queued = None
        self._forget_ahead()
        self.time.end()

    def _forget_ahead(self) -> None:
        self._ahead.clear()
        self._quiet_until_s = 0.0

    def _planned_end(self) -> Joints:
        """Place of rest before the moves that wait (rad)."""
        if self._queued is None or self.time.stopping:
            return self.rest_after_stop()
        return self._queued.end
