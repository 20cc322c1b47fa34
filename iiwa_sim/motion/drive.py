"""The drive: runs moves one after the other, blended where they may be, and stops them on their path."""

from collections.abc import Sequence

import numpy as np

from iiwa_sim.motion.even_kernel import EvenTicks
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.queue.chain import Ahead, Chain
from iiwa_sim.motion.queue.look_ahead import LookAhead
from iiwa_sim.motion.queue.move import Move
from iiwa_sim.motion.queue.planning import ending
from iiwa_sim.motion.queue.waiting import Waiting, among
from iiwa_sim.motion.rate import PlannedTime
from iiwa_sim.motion.rate_change import Running

AHEAD = 128
"""Ticks for which joint positions are computed at once: for a line at a sixth of the cost of single ones."""


class Drive(EvenTicks):
    """Joint positions (rad) over ticks.

    A move starts in the tick after it is appended, or when the moves before it have ended, also within a
    tick. Moves that wait when a move is cancelled are planned again from where the robot will come to rest,
    one in each tick, as far as their start differs. If one of them is impossible from there, it is dropped
    together with those behind it.
    """

    def __init__(self, joints: Joints, time: PlannedTime, lowest: Array, highest: Array) -> None:
        """The robot rests at `joints` (rad), with the limits of positions (n,)."""
        self.joints = joints
        self.rest = joints
        """Where the robot comes to rest after all moves, or after the stop in progress (rad)."""
        self._time: PlannedTime = time
        self._look_ahead = LookAhead(time, lowest, highest)
        self._chain: Chain | None = None
        self._version = 0  # planned joint positions of the chain
        self._waiting = Waiting()
        self._planned, self._again = self._waiting.planned, self._waiting.again
        self._ahead, self._quiet_until_s, self._last = [], 0.0, 0

    @property
    def stopping(self) -> bool:
        """Whether a move is being stopped."""
        return self._chain is not None and self._time.stopping

    @property
    def waiting(self) -> int:
        """Number of moves that have not begun."""
        waiting = len(self._waiting.planned) + len(self._waiting.again)
        if self._chain is None or self._time.stopping:
            return waiting
        return waiting + self._chain.waiting(self._time.time_s)

    @property
    def behind(self) -> int:
        """Number of moves behind the one that runs, or begins in the next tick."""
        waiting = self.waiting
        return waiting - 1 if waiting and self._chain is None else waiting

    @property
    def moves(self) -> Sequence[Move]:
        """The move that runs, unless it is being stopped, and those behind it, in their order."""
        chain, begun = self._chain, list[Move]()
        if chain is not None and not self._time.stopping:
            begun = list(chain.moves[-1 - chain.waiting(self._time.time_s) :])
        return [*begun, *self._waiting]

    @property
    def running(self) -> Running | None:
        """The motion that runs at the override; None if there is none."""
        return None if self._chain is None or self._time.stopping else self._time.running(self._chain)

    @property
    def goal(self) -> Joints:
        """End of the running move, of the first waiting move, or of a stop (rad); the present position at
        rest."""
        if self._chain is None:
            return self._waiting.first.path.end if self._waiting.any else self.joints
        if self._time.stopping:
            return self.rest_after_stop()
        return self._chain.move_at(self._time.time_s).path.end

    def is_pending(self, number: int) -> bool:
        """Whether a move runs, and is not being stopped, or waits."""
        under_way = self.under_way
        if under_way and self._chain is not None:
            if number <= under_way:
                return number == under_way
            if among(self._chain.moves, number):
                return True
        return bool(self._waiting.planned or self._waiting.again) and number in self._waiting

    def abandon(self) -> None:
        """Drop the running and the waiting moves: another motion takes over."""
        self._end_chain()
        self._waiting.clear()
        self.rest = self.joints

    def append(self, move: Move) -> None:
        """Queue a move that begins at `rest`."""
        waiting, override = self._waiting, self._time.override
        self.rest = move.path.end
        slowed = override.value < override.rate and override.part_to_keep != 1.0
        waiting.apart = (waiting.apart or move.number) if slowed else 0
        (waiting.again or waiting.planned).append(move)
        self._quiet_until_s = 0.0

    def rest_after_stop(self) -> Joints:
        """Where the robot would come to rest after a stop now (rad)."""
        if self._chain is None:
            return self.joints
        return self._chain.joints(self._time.rest_s())

    def planned_state(self) -> tuple[Joints, Joints, Joints]:
        """Positions (rad) of a running move, and their derivatives by planned time (rad/s, rad/s^2)."""
        assert self._chain is not None
        q, velocity, acceleration, _ = self._chain.along(np.array([self._time.time_s]))[0][0].tolist()
        return tuple(q), tuple(velocity), tuple(acceleration)

    def stop(self) -> None:
        """Stop on the path, and drop the waiting moves."""
        self._waiting.clear()
        self._time.stop()
        self.rest = self.rest_after_stop()

    def cancel(self) -> None:
        """End the move that runs, or begins in the next tick: stop on its path, and go on with the next move
        from there.

        Moves that it was blended into are done if the robot passes their targets while it brakes. During a
        stop no move runs, and nothing changes.
        """
        chain = self._chain
        if chain is None:
            self._waiting.drop_first()
        elif self._time.stopping:
            return
        else:
            cancelled = self.under_way
            self._time.stop()
            resumed = max(chain.move_at(self._time.rest_s()).number, cancelled + 1)
            self._waiting.put_back([move for move in chain.moves if move.number >= resumed])
        self._plan_again()

    def clear(self) -> None:
        """Drop the moves behind the one that runs, or begins in the next tick, which ends at its target.

        If it has begun to blend into the next move, or is too fast to rest at its target, the robot stops on
        its path.
        """
        chain, kept = self._chain, list[Move]()
        if chain is None:
            kept = [self._waiting.first] if self._waiting.any else []
        elif not self._time.stopping:
            if chain.moves[-1].number > self.under_way:
                now_s = self._time.time_s
                shorter = ending(chain, now_s, now_s + self._look_ahead.kept_s)
                if shorter is None:
                    self._time.stop()
                else:
                    self._go_along(shorter)
            self._ahead.clear()
            self._look_ahead.forget()
        self._waiting.clear()
        self._waiting.again.extend(kept)
        self.rest = kept[0].path.end if kept else self._planned_end()

    def start_from(self, joints: Joints) -> None:
        """Start from other joint positions (rad), at rest: another motion has moved the robot, or will have.

        Waiting moves are planned again from there.
        """
        self.joints = joints
        self._plan_again()

    def step(self) -> None:
        """Make one tick. If a path fails, the robot rests where it is, the waiting moves are dropped, and
        the path's exception is raised."""
        if self.step_evenly():
            return
        try:
            self._advance()
        except Exception:
            self.abandon()
            raise

    def _advance(self) -> None:
        waiting = self._waiting.planned
        if self._waiting.again:
            self.rest = self._waiting.plan_next_again(self._planned_end)
            self._quiet_until_s = 0.0
        chain = self._chain
        if chain is None:
            if not waiting:
                return
            if waiting[0].length_s == 0.0:
                # One impossible move in each tick: the time of several might add up to a late tick.
                self.joints = waiting.popleft().path.end
                return
            chain = self._begin(0.0)  # it costs as much as a look ahead, so it waits for the next tick
            if chain is None:
                return
        elif not self._time.stopping and (self._ahead or self._time.standing or not self._time.even):
            # A tick that computes joint positions ahead has enough to do.
            slowed = self._time.override.part_to_keep != 1.0
            ahead = self._look_ahead.step(chain, self._waiting.to_look_at() if slowed else waiting)
            chain = self._take(chain, ahead)
            self._quiet_until_s = 0.0 if slowed else self._look_ahead.quiet_until_s
        self._time.step()
        while self._time.time_s >= chain.rest_s:
            self.joints = chain.end
            left_s = 0.0 if self._time.stopping else self._time.time_s - chain.rest_s
            self._end_chain()
            if not waiting or waiting[0].length_s == 0.0 or (chain := self._begin(left_s)) is None:
                return
        if self._time.stopping:
            self.joints = chain.joints(self._time.time_s)
            if self._time.stopped:
                self._end_chain()
        elif not self._time.even:
            self._ahead.clear()
            self.joints = chain.joints(self._time.time_s)
        elif not self._time.standing:
            if not self._ahead:
                times = self._time.ticks(AHEAD)
                joints = chain.joints_along(times[times < chain.rest_s])
                self._ahead = list(map(tuple, joints[::-1].tolist()))
            self.joints = self._ahead.pop()

    def _begin(self, time_s: float) -> Chain | None:
        """A chain that begins with the next move, begun that long ago; None while it is being planned."""
        begins = self._look_ahead.begin(self._waiting.planned)
        if begins is None:
            return None
        self._go_along(*begins)
        self._ahead.clear()
        self._look_ahead.forget()
        self._time.begin(time_s)
        return begins.chain

    def _go_along(self, chain: Chain, moves: int = 0) -> None:
        """Run a chain, with so many of the moves that waited: they do not wait any more."""
        for _ in range(moves):
            self._planned.popleft()
        self._version += 1
        self._chain, chain.version = chain, self._version
        self._quiet_until_s, self._last = 0.0, 0

    def _end_chain(self) -> None:
        self._chain, self._last = None, 0
        self._ahead.clear()

    def _take(self, chain: Chain, ahead: Ahead | None) -> Chain:
        """The chain under way, or another, with moves that do not wait any more."""
        if ahead is None:
            return chain
        self._go_along(*ahead)
        del self._ahead[: max(len(self._ahead) - self._time.ticks_until(ahead.chain.front_s), 0)]
        return ahead.chain

    def _plan_again(self) -> None:
        """Let what waits be planned again."""
        self._waiting.plan_all_again()
        self._look_ahead.forget()
        self.rest = self._waiting.last.path.end if self._waiting.any else self._planned_end()

    def _planned_end(self) -> Joints:
        """End of the last move that need not be planned again (rad)."""
        if self._waiting.planned:
            return self._waiting.planned[-1].path.end
        if self._chain is None or self._time.stopping:
            return self.rest_after_stop()
        return self._chain.end
