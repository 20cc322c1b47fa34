"""From one move into the next: what turn that is, and the blend that rounds the corner between them."""

from math import sqrt
from typing import NamedTuple

import numpy as np

from iiwa_sim.motion.blend import Blend, Place
from iiwa_sim.motion.bounds import Bounds
from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.motion.move import Move
from iiwa_sim.motion.sampled_path import Joints
from iiwa_sim.motion.zone import Zone, way_inside

BACK = 4.0  # times as slow as at its ends: a blend in which the joints turn back, which jerk limits make slow
STEADY = 0.7  # of the speed beside a blend: less, and to turn at the target is nearly always over sooner
SHRINKING = 0.85
SHRINKINGS = 12
ROUNDING = 1.0 + 1e-9
SHORTEST_WAY_RAD = 1e-6
"""Of the joints, on either side of a corner: what would be cut off less is a stop at the target."""


WINDOW = 1.2
"""Of the time in which full jerk builds up full acceleration; see docs/motion.md for the choice."""


def window_of(limits: JointLimits) -> float:
    """The length of the moving average through which a chain runs (s)."""
    return WINDOW * float((limits.acceleration / limits.jerk).max())


class Corner(NamedTuple):
    """How a corner is rounded."""

    blend: Blend
    bounds: Bounds
    """Over the blend, from 0."""
    before: float
    """How much of the first path it replaces, in the chain's parameter."""


def turning_share(first: Move, second: Move) -> float:
    """The part of the acceleration limits with which the robot can brake in a move and accelerate in the next
    at the same time.

    While it stops braking and begins to accelerate, the acceleration of a joint changes by between 0, where
    it turns back, and twice its limit, where it goes straight on. That is its jerk.
    """
    braking = first.path.samples.dq[-1] / first.limits.acceleration
    leaving = second.path.samples.dq[0] / second.limits.acceleration
    change = float(np.abs(braking / np.abs(braking).max() + leaving / np.abs(leaving).max()).max())
    return 1.0 / max(change, 1.0)


def rounded(first: Move, second: Move, lowest: Array, highest: Array) -> Corner | None:
    """The corner between two moves; None where there is none to round, or it cannot be driven round steadily.

    The blend stays in the zone and within the position limits (rad, (n,)): where it would leave them, less is
    cut off.
    """
    if first.zone is None or second.length_s == 0.0:
        return None
    if not np.array_equal(first.limits.acceleration, second.limits.acceleration):
        return None  # a chain has one window; the next move sets out while this one brakes, each in its own
    zone = first.zone.clipped(first.path, second.path)
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
            velocity = blend.velocity_limits(first.limits, second.limits)
            bounds = Bounds.of(blend.samples(), second.limits, velocity)
            fastest = max(_reach(first, bounds, 0), _reach(second, bounds, -1)) ** 2
            cap = bounds.velocity_cap
            if cap.max() > BACK**2 * max(float(cap[0]), float(cap[-1])):
                return None
            if (bounds.curve_cap < STEADY**2 * cap.clip(max=fastest)).any():
                return None
            if _detour_s(bounds) > window_of(first.limits) + 1.0 / float(bounds.room[:, [0, -1]].min()):
                return None
            return Corner(blend, bounds, before * first.length_s)
        before, after = SHRINKING * before, SHRINKING * after
    return None


def _detour_s(bounds: Bounds) -> float:
    """How much longer the way through a blend takes at full speed than the ways to and from the target.

    Between slow moves of different joints it may be longer than to stop between them.
    """
    speed = np.sqrt(np.minimum(bounds.velocity_cap, bounds.curve_cap))
    way = np.diff(bounds.s)
    return float((2.0 * way / (speed[1:] + speed[:-1])).sum() - way.sum())


def _reach(move: Move, bounds: Bounds, end: int) -> float:
    """About the speed that a move would reach that sets out and comes to rest by itself."""
    length = move.length_s
    return length / (sqrt(length / float(bounds.room[:, end].min())) + window_of(move.limits) / 2.0)


def _place(move: Move, s: float) -> Place:
    dq, ddq = move.path.samples.at(s)
    return np.array(move.path.joints(s)), dq / move.length_s, ddq / move.length_s**2


def _stays_inside(places: list[Joints], zone: Zone, lowest: Array, highest: Array) -> bool:
    q = np.array(places)
    if (q < lowest).any() or (q > highest).any():
        return False
    return all(zone.distance(joints) <= zone.radius * ROUNDING for joints in places[1:-1])
