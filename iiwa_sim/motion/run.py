"""A run: chains of moves, each of which sets out a little before the one before it has come to rest."""

from bisect import bisect_right
from collections.abc import Iterator

import numpy as np

from iiwa_sim.motion.chain import Chain
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.sampled_path import Joints


class Run:
    """Joint positions over the time since the first chain has set out.

    No more than two chains move at once. Then the joints are where the first is, plus what the second has
    gone.
    """

    def __init__(self, chain: Chain) -> None:
        self._starts = [0.0]
        self._chains = [chain]

    def add(self, chain: Chain, start_s: float) -> None:
        """A chain that sets out at a time in the last one's, at which the one before that is at rest."""
        self._starts.append(self._starts[-1] + start_s)
        self._chains.append(chain)

    def replace_last(self, chain: Chain) -> None:
        """Put another chain in place of the last one: the same until now."""
        self._chains[-1] = chain

    def forget(self, time_s: float) -> None:
        """Drop the chains that are at rest at a time."""
        while len(self._chains) > 1 and self._starts[0] + self._chains[0].rest_s <= time_s:
            del self._starts[0], self._chains[0]

    @property
    def last(self) -> Chain:
        """The last chain."""
        return self._chains[-1]

    def in_last(self, time_s: float) -> float:
        """The time in the last chain; 0 where it has not set out."""
        return max(time_s - self._starts[-1], 0.0)

    def from_last(self, time_s: float) -> float:
        """The time at a time in the last chain."""
        return self._starts[-1] + time_s

    def alone_s(self, time_s: float) -> float:
        """The time in the last chain from which on, or now, no other moves: before it nothing may change."""
        if len(self._starts) == 1:
            return self.in_last(time_s)
        return max(self._starts[-2] + self._chains[-2].rest_s - self._starts[-1], self.in_last(time_s))

    @property
    def rest_s(self) -> float:
        """When all is done."""
        return self._starts[-1] + self._chains[-1].rest_s

    def joints(self, time_s: float) -> Joints:
        """Joint positions (rad) at a time."""
        k = bisect_right(self._starts, time_s) - 1
        joints = self._chains[k].joints(time_s - self._starts[k])
        if k == 0 or time_s >= self._starts[k - 1] + self._chains[k - 1].rest_s:
            return joints
        before = self._chains[k - 1]
        braking = before.joints(time_s - self._starts[k - 1])
        return tuple([a + (b - c) for a, b, c in zip(joints, braking, before.end, strict=True)])

    def joints_along(self, times: Array) -> Array:
        """The same (m, n) at rising times (m,) before `rest_s`, for less where there are many."""
        parts = []
        for k, first, both, last in self._parts(times):
            if first == last:
                continue
            joints = self._chains[k].joints_along(times[first:last] - self._starts[k])
            if first < both:
                before = self._chains[k - 1]
                braking = before.joints_along(times[first:both] - self._starts[k - 1])
                joints[: both - first] += braking - np.array(before.end)
            parts.append(joints)
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def _parts(self, times: Array) -> Iterator[tuple[int, int, int, int]]:
        """Of each chain the first of the times, the first at which the one before is at rest, and the end."""
        borders = times.searchsorted(self._starts).tolist()
        borders[0] = 0
        for k, (first, last) in enumerate(zip(borders, [*borders[1:], len(times)], strict=True)):
            both = first
            if k:
                both = int(times.searchsorted(self._starts[k - 1] + self._chains[k - 1].rest_s))
            yield k, first, min(max(both, first), last), last

    def move_at(self, time_s: float) -> int:
        """The number of the move that is under way at a time."""
        k = self._at(time_s)
        return self._chains[k].move_at(time_s - self._starts[k])

    def goal(self, time_s: float) -> Joints:
        """Where the move that is under way at a time ends (rad)."""
        number = self.move_at(time_s)
        moves = self._chains[self._at(time_s)].moves
        return next(move.path.end for move in moves if move.number == number)

    def moves_from(self, number: int) -> list[Move]:
        """Those of this number and after it, in their order."""
        return [move for chain in self._chains for move in chain.moves if move.number >= number]

    def end_with_move_at(self, time_s: float) -> bool:
        """Let the move that is under way at a time be the last one.

        False, and nothing is changed, where the robot has begun to leave its path for the next one's, or is
        too fast to rest at its target.
        """
        k = self._at(time_s)
        later = self._starts[k + 1 : k + 2]
        if (later and later[0] <= time_s) or not self._chains[k].end_with_move_at(time_s - self._starts[k]):
            return False
        del self._starts[k + 1 :], self._chains[k + 1 :]
        return True

    def waiting(self, time_s: float) -> int:
        """How many moves have not begun at a time."""
        k = self._at(time_s)
        later = sum(len(chain.moves) for chain in self._chains[k + 1 :])
        return self._chains[k].waiting(time_s - self._starts[k]) + later

    def _at(self, time_s: float) -> int:
        """Of two chains that move at once the first counts until it is at rest."""
        k = bisect_right(self._starts, time_s) - 1
        if k and time_s < self._starts[k - 1] + self._chains[k - 1].rest_s:
            return k - 1
        return k
