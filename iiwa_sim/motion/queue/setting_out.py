"""Short moves that are planned together before the robot sets out."""

from collections import deque
from itertools import islice, pairwise

from iiwa_sim.motion.queue.alone import alone_s
from iiwa_sim.motion.queue.chain import Ahead
from iiwa_sim.motion.queue.corner import may_blend
from iiwa_sim.motion.queue.move import Move
from iiwa_sim.motion.slices import Slices

SHORT_S = 0.05
"""A move that takes less at its full speed is short. Short moves are planned together before the robot sets
out, where the first of them, alone from rest to rest, takes between `TINY_S` and `LONG_ENOUGH_S`."""
LONG_ENOUGH_S = 0.2
TINY_S = 0.035
"""Below this there is nothing to gain, but with several such moves that take twice as long together."""
MOST_AT_FIRST = 12


class SettingOut:
    """Short moves that are planned together before they set out from rest."""

    def __init__(self, number: int, work: Slices[Ahead | None]) -> None:
        """`number` is that of the first move; `work` ends with their chain, or None."""
        self.number = number
        self.over = False
        self.ahead: Ahead | None = None
        self._work = work

    def go_on(self, slices: int) -> None:
        for _ in range(slices):
            if self.over:
                return
            try:
                next(self._work)
            except StopIteration as end:
                self.over, self.ahead = True, end.value


def are_short(waiting: deque[Move]) -> bool:
    """Whether the first of moves, two at the least, are short, and to be planned together before the robot
    sets out."""
    if waiting[0].length_s >= SHORT_S or not may_blend(waiting[0], waiting[1]):
        return False
    first_s = alone_s(waiting[0])
    return TINY_S < first_s < LONG_ENOUGH_S or (first_s <= TINY_S and _are_worth_it(waiting))


def _are_worth_it(waiting: deque[Move]) -> bool:
    """Whether tiny moves are so many that there is something to gain, all together."""
    gain_s = 0.0
    for one, other in pairwise(islice(waiting, MOST_AT_FIRST)):
        one_s = alone_s(one)
        if one_s > 2.0 * TINY_S or not may_blend(one, other):
            return False
        gain_s += one_s
        if gain_s > 2.0 * TINY_S:
            return True
    return False
