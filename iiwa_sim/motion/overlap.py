"""Where a chain of moves may set out before the one before it has come to rest.

At a corner too sharp to be driven round, the robot turns while it still brakes: for a while both motions are
added, so that the joints are where the first is, plus what the second has gone. The first then brakes along
its path and the second accelerates along its own, each within the limits; added, they are looked at in small
steps, and the longest overlap that keeps the limits is taken. A turn back, and many a turn by a right angle,
needs no more acceleration in any joint than either motion alone; two motions in one line would need twice the
jerk.
"""

import numpy as np

from iiwa_sim.motion.chain import Chain
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.slices import Slices
from iiwa_sim.motion.zone import Zone, way_inside

STEP_S = 0.0005
DIFFERENCE = 2  # steps: the shortest tick, through which short jerks are seen as the robot shows them
BESIDE = 3 * DIFFERENCE
LONGEST_S = 0.4
SHORTEST_S = 0.006
PARTS = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1)  # of the longest overlap that the zone allows
KEPT = (0.998, 0.998, 0.95)  # of velocity, acceleration and jerk limits: ticks between steps may see more
PLACES = 16  # looked at for whether the robot stays in the zone
ROUNDING = 1.0 + 1e-9


def set_out_s(
    first: Chain, second: Chain, time_s: float, lowest: Array, highest: Array
) -> Slices[float | None]:
    """When the second chain may set out, in the time of the first and not before `time_s`.

    None where no overlap keeps the limits.
    """
    ending, beginning = first.moves[-1], second.moves[0]
    if ending.zone is None:
        return None
    zone = ending.zone.clipped(ending.path, beginning.path)
    earliest = max(first.time_of(ending, 1.0 - way_inside(ending.path, zone, at_end=True)), time_s)
    latest = second.time_of(beginning, way_inside(beginning.path, zone, at_end=False))
    longest = min(first.rest_s - earliest, latest, LONGEST_S)
    count = int(longest / STEP_S)
    if longest < SHORTEST_S:
        return None
    # Both from three differences before the longest overlap to three after it.
    at: Array = STEP_S * np.arange(-BESIDE, count + BESIDE + 1, dtype=np.float64)
    braking = _at(first, first.rest_s - longest + at)
    yield
    leaving = _at(second, at) - np.array(first.end)
    yield
    velocity = np.maximum(ending.limits.velocity, beginning.limits.velocity)
    limits = velocity, ending.limits.acceleration, ending.limits.jerk
    first_loads, second_loads = _loads(braking, limits), _loads(leaving, limits)
    for part in PARTS:
        steps = int(part * longest / STEP_S)
        if steps * STEP_S < SHORTEST_S:
            break
        if np.abs(first_loads[count - steps :] + second_loads[: steps + BESIDE + 1]).max() > 1.0:
            continue
        q = braking[count - steps :] + leaving[: steps + 2 * BESIDE + 1]
        if (q > lowest).all() and (q < highest).all() and _stays_inside(q, zone):
            return first.rest_s - longest + (count - steps) * STEP_S
    return None


def _at(chain: Chain, times: Array) -> Array:
    """Joint positions (m, n) of a chain, also before it has set out and after it has come to rest."""
    inside = times.clip(0.0)
    moving = chain.joints_along(inside[inside < chain.rest_s])
    joints = np.empty((len(times), moving.shape[1]))
    joints[: len(moving)] = moving
    joints[len(moving) :] = chain.end
    return joints


def _loads(q: Array, limits: tuple[Array, Array, Array]) -> Array:
    """Velocity, acceleration and jerk of each joint over what is kept, with signs (m - BESIDE, 3 n)."""
    count = q.shape[1]
    loads = np.empty((len(q) - BESIDE, 3 * count))
    differences = q
    for order, (limit, kept) in enumerate(zip(limits, KEPT, strict=True)):
        differences = (differences[DIFFERENCE:] - differences[:-DIFFERENCE]) / (DIFFERENCE * STEP_S)
        loads[:, order * count : (order + 1) * count] = differences[: len(loads)] / (kept * limit)
    return loads


def _stays_inside(q: Array, zone: Zone) -> bool:
    inner = q[BESIDE:-BESIDE]
    places = inner[:: max(len(inner) // PLACES, 1)].tolist()
    return all(zone.distance(joints) <= zone.radius * ROUNDING for joints in places)
