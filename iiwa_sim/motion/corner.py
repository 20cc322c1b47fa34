"""From one move into the next: where the corner between them is cut, and the blend that rounds it."""

from typing import NamedTuple

import numpy as np

from iiwa_sim.motion.blend import Blend, Place
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.path import Joints
from iiwa_sim.motion.zone import Zone, way_inside

SHRINKING = 0.85
SHRINKINGS = 12
ROUNDING = 1.0 + 1e-9
SHORTEST_WAY_RAD = 1e-6
"""Of the joints, on either side of a corner: what would be cut off less is a stop at the target."""


class Corner(NamedTuple):
    """How a corner is rounded."""

    blend: Blend
    before: float
    """How much of the first path it replaces, in the chain's parameter."""


def rounded(first: Move, second: Move, lowest: Array, highest: Array) -> Corner | None:
    """The corner between two moves, or None where the first stops at its target.

    The blend stays in the zone and within the position limits (rad, (n,)): where it would leave them, less is
    cut off.
    """
    zone = first.zone
    if zone is None or second.length_s == 0.0:
        return None
    before = way_inside(first.path, zone, at_end=True)
    after = way_inside(second.path, zone, at_end=False)
    for _ in range(SHRINKINGS):
        leaves = _place(first, 1.0 - before)
        enters = _place(second, after)
        target = np.array(first.path.end)
        if min(np.abs(leaves[0] - target).max(), np.abs(enters[0] - target).max()) < SHORTEST_WAY_RAD:
            return None
        blend = Blend(leaves, enters, before * first.length_s, after * second.length_s)
        if _stays_inside(blend.places, zone, lowest, highest):
            return Corner(blend, before * first.length_s)
        before, after = SHRINKING * before, SHRINKING * after
    return None


def _place(move: Move, s: float) -> Place:
    dq, ddq = move.path.samples.at(s)
    return np.array(move.path.joints(s)), dq / move.length_s, ddq / move.length_s**2


def _stays_inside(places: list[Joints], zone: Zone, lowest: Array, highest: Array) -> bool:
    q = np.array(places)
    if (q < lowest).any() or (q > highest).any():
        return False
    return all(zone.distance(joints) <= zone.radius * ROUNDING for joints in places[1:-1])
