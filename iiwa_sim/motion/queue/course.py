"""The course of a chain: its moves' paths, joined at corners, over one x."""

from collections.abc import Sequence
from itertools import accumulate

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.queue.chain_kernel import JointPath
from iiwa_sim.motion.queue.corner import Corner
from iiwa_sim.motion.queue.move import Move

NO_CORNER = Corner(0.0, 0.0, 1.0)


class Course:
    """Joint positions over x, from `first_x` at the start of the first move to the end of the last. Each move
    takes as much of x as its `length_s`."""

    def __init__(
        self,
        moves: Sequence[Move],
        corners: Sequence[Corner],
        first_x: float = 0.0,
        window_s: float | None = None,
    ) -> None:
        """`corners[k]` lies between the moves k and k + 1, at the target of the former."""
        self.moves = list(moves)
        self.corners = [NO_CORNER, *corners, NO_CORNER]
        self.first_x = first_x
        # `accumulate` takes a tenth of what `cumsum` does, which matters for a move alone.
        self.targets = np.array([first_x + x for x in accumulate((m.length_s for m in moves), initial=0.0)])
        before, after, rho = (np.array(each) for each in zip(*self.corners, strict=True))
        limits = np.array([move.limits for move in moves])
        self.before, self.after = before, after
        self.joint_count = limits.shape[2]
        self.way = JointPath(self.targets, before, after, rho, [move.path for move in moves], limits)
        self.window_s = float((limits[:, 1] / limits[:, 2]).max()) if window_s is None else window_s
        """Time (s) in which full jerk builds up full acceleration; x is a mean over so long."""

    @property
    def end_x(self) -> float:
        return float(self.targets[-1])

    def gone_on(self, x: float, moves: Sequence[Move], corners: Sequence[Corner]) -> "Course":
        """The course from an x on, with more moves at its end, each behind a corner."""
        gone = 0
        while gone < len(self.moves) - 1:
            after = self.corners[gone + 1].after * self.moves[gone + 1].length_s
            if x < self.targets[gone + 1] + after:
                break
            gone += 1
        kept = [*self.corners[gone + 1 : -1], *corners]
        return Course([*self.moves[gone:], *moves], kept, float(self.targets[gone]), self.window_s)

    def leaves_x(self, move: Move) -> float:
        """x where the corner at the end of a move begins."""
        count = self.moves.index(move) + 1
        return float(self.targets[count]) - self.corners[count].before * self.moves[count - 1].length_s

    def ending(self, x: float, move: Move, reached: float) -> "Course | None":
        """The course from an x on up to the end of a move; None where `reached`, an x, is beyond the path of
        that move."""
        if reached >= self.leaves_x(move):
            return None
        left = self.gone_on(x, [], [])
        count = left.moves.index(move) + 1
        return Course(left.moves[:count], left.corners[1:count], left.first_x, self.window_s)

    def at(self, x: Array) -> tuple[Array, Array]:
        """Joint positions and their derivatives over x (m, 4, n) at rising x (m,), and the limits there (m,
        3, n)."""
        found = np.empty((len(x), 4, self.joint_count))
        limits = np.empty((len(x), 3, self.joint_count))
        self.way.derivatives(x, found, limits)
        return found, limits

    def corner_spans(self) -> tuple[Array, Array]:
        """x at which each corner begins, and at which it ends."""
        before, after = self.before, self.after
        lengths = np.diff(self.targets)
        round_them = np.flatnonzero(before[1:-1]) + 1
        return (
            self.targets[round_them] - before[round_them] * lengths[round_them - 1],
            self.targets[round_them] + after[round_them] * lengths[round_them],
        )
