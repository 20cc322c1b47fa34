"""The moves that wait behind the trajectory under way, and those of them that have to be planned again."""

from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from operator import attrgetter

from iiwa_sim.motion.blend import Move
from iiwa_sim.motion.joints import Joints

SAME_RAD = 1e-10
"""A waiting move that was planned from within this distance of the robot's position is not planned again."""

_number = attrgetter("number")


class Waiting:
    """Moves in the order in which they were accepted: first those that are planned from where they begin.

    A move that comes is added behind all others.
    """

    def __init__(self) -> None:
        """Begin without moves."""
        self.planned: deque[Move] = deque()
        self.again: deque[Move] = deque()
        """Behind those: to be planned again, as they may begin elsewhere."""

    def __iter__(self) -> Iterator[Move]:
        yield from self.planned
        yield from self.again

    def __contains__(self, number: int) -> bool:
        return among(self.planned, number) or among(self.again, number)

    @property
    def any(self) -> bool:
        """True if a move waits."""
        return bool(self.planned or self.again)

    @property
    def first(self) -> Move:
        """The move that begins next; one must wait."""
        return (self.planned or self.again)[0]

    @property
    def last(self) -> Move:
        """The move behind all others; one must wait."""
        return (self.again or self.planned)[-1]

    def drop_first(self) -> None:
        """Forget the move that begins next, if one waits."""
        if self.any:
            (self.planned or self.again).popleft()

    def put_back(self, moves: Sequence[Move]) -> None:
        """Put moves back, which wait again, before all others."""
        self.planned.extendleft(reversed(moves))

    def clear(self) -> None:
        """Forget all."""
        self.planned.clear()
        self.again.clear()

    def plan_all_again(self) -> None:
        """Plan all waiting moves again: they may begin elsewhere."""
        self.again.extendleft(reversed(self.planned))
        self.planned.clear()

    def plan_next_again(self, planned_end: Callable[[], Joints]) -> Joints:
        """Plan the next of the moves that would begin elsewhere; those before it are as they were.

        If it cannot begin there, it is forgotten with all behind it. `planned_end` gives where the last of
        the planned moves ends, or the trajectory (rad). Return where the last of all ends, as far as known.
        """
        planned = False
        while self.again:
            start = planned_end()
            move: Move | None = self.again[0]
            if not _same(self.again[0].path.start, start):
                if planned:
                    break
                move, planned = self.again[0].again(start), True
            if move is None:
                self.again.clear()
                return start
            self.again.popleft()
            self.planned.append(move)
        return self.last.path.end if self.again else planned_end()


def among(moves: Sequence[Move], number: int) -> bool:
    """Return whether one of these moves, in the order of their numbers, has this number."""
    k = bisect_left(moves, number, key=_number)
    return k < len(moves) and moves[k].number == number


def _same(one: Joints, other: Joints) -> bool:
    return all(abs(a - b) <= SAME_RAD for a, b in zip(one, other, strict=True))
