"""How a corner is rounded: the second of two moves sets out while the first one still goes to its end.

With v from 0 to 1 the first goes on to its target as s = 1 - before F(1 - v) while the second leaves it as
s = after F(v), and the joints are where the first is plus what the second has gone. F grows with the third
power of v up to v = rho, and then with the second, as far as F(1) = 1: F'' is v / rho, then even. So a corner
is a parabola along which one speed goes over evenly into the other, but for rho of it at either end, in which
the acceleration builds up. As F(v) + F(1 - v) <= 1, the sum of two straight ways stays in any ball around the
target that holds their ends.
"""

from typing import NamedTuple

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.queue.corner_kernel import Side, fitted
from iiwa_sim.motion.queue.move import Move


class Corner(NamedTuple):
    """How two moves are added at the target between them."""

    before: float
    """Part of the first move that is left when the second sets out."""
    after: float
    """Part of the second move that is done when the first ends."""
    rho: float
    """Part of the corner in which accelerations build up (0..1]."""


def corner(first: Move, second: Move, lowest: Array, highest: Array) -> Corner | None:
    """The corner between two moves; None where the robot has to stop at the target between them.

    `lowest` and `highest` are the position limits (rad, (n,)).
    """
    if first.zone is None or first.length_s == 0.0 or second.length_s == 0.0:
        return None
    zone = first.zone.clipped(first.path, second.path)
    before = zone.part_inside(first.path, at_end=True)
    after = zone.part_inside(second.path, at_end=False)
    found = fitted(side(first, at_end=True), side(second, at_end=False), before, after, zone, lowest, highest)
    return Corner(*found) if found else None


def side(move: Move, *, at_end: bool) -> Side:
    """One side of a corner: a move that comes to rest at its end, or sets out."""
    return Side(move.path, *move.limits, at_end)


def may_blend(first: Move, second: Move) -> bool:
    """Whether the robot need not stop between two moves."""
    return first.zone is not None and second.length_s > 0.0
