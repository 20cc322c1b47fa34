"""How long moves take with a stop before and behind each of them."""

from collections.abc import Sequence

from iiwa_sim.motion.queue.chain import Chain
from iiwa_sim.motion.queue.corner import side
from iiwa_sim.motion.queue.move import Move
from iiwa_sim.motion.queue.planning import begun
from iiwa_sim.motion.slices import Slices

ABOUT = 0.95


def alone_s(move: Move) -> float:
    """How long (s) a move takes from rest to rest at the least; about so, where joints do not go straight."""
    if move.length_s == 0.0:
        return 0.0
    part = 1.0 if move.path.straight else ABOUT
    halves_s: float = side(move, at_end=False).time_s(0.5) + side(move, at_end=True).time_s(0.5)
    return part * halves_s


def at_least_s(chain: Chain) -> float:
    """A lower bound of when the chain under way ends (s), once it is as fast as it can be."""
    return min(chain.rest_s, sum(map(alone_s, chain.moves))) if chain.rough else chain.rest_s


def may_be_slower(gained_s: float, moves: Sequence[Move]) -> bool:
    """Whether moves that take `gained_s` together might take less with stops between: a cheap bound."""
    return gained_s > sum(map(alone_s, moves))


def slower(gained_s: float, moves: Sequence[Move]) -> Slices[bool]:
    """Whether moves that take `gained_s` together would take less with stops between them."""
    stopping_s = 0.0
    if may_be_slower(gained_s, moves):
        for move in moves:
            yield
            stopping_s += begun(move).rest_s
            if stopping_s >= gained_s:
                return False
        return True
    return False
