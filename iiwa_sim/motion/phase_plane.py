"""How fast a curved path can be run: limits of velocity and acceleration only, no jerk.

The state is b = (ds/dt)^2 at the samples of a path. A joint with q', q'' bounds it twice: its velocity limit
caps b, and its acceleration q' dds + q'' b bounds dds = (db/ds)/2 from both sides, by straight lines in b.
The fastest b is found as in all methods of this family (Bobrow, Dubowsky, Gibson 1985): backwards from the
end with full braking, then forwards from the start with full acceleration.
"""

import math

import numpy as np

from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.motion.path import PathSamples

LEVELS = 4  # the bounds on dds are tabulated at this many steps of b between rest and its cap
LEVEL_PARTS = np.arange(LEVELS + 1) / LEVELS
TINY = 1e-9


class PhasePlane:
    """The bounds on b and dds along a path."""

    def __init__(self, samples: PathSamples, limits: JointLimits) -> None:
        # Joints come first, samples second: reductions over joints then run along memory.
        dq = np.ascontiguousarray(samples.dq.T)
        rate = np.maximum(np.abs(dq), TINY)
        widths = np.diff(samples.s)
        self._grow = np.zeros((2, len(samples.s), 1))
        self._grow[0, :-1, 0] = self._grow[1, 1:, 0] = 2.0 * widths
        self._velocity_cap = (limits.velocity[:, None] / rate).min(axis=0) ** 2
        # A joint allows dds up to `room + bend * b` and down to `-room + bend * b`.
        self._room = limits.acceleration[:, None] / rate
        self._bend = -np.sign(dq) * samples.ddq.T / rate
        # Beyond this b the upper bound of one joint lies below the lower bound of another.
        closing = np.maximum(self._bend[None] - self._bend[:, None], TINY)
        self._curve_cap = ((self._room[None] + self._room[:, None]) / closing).min(axis=(0, 1))

    def fastest(self, share: Array) -> tuple[list[float], float, float]:
        """Speeds ds/dt at the samples from rest to rest, and the accelerations possible at start and end.

        `share` (m,) is the part of each acceleration limit that may be used at each sample, above 0 up to 1.
        """
        cap = np.minimum(self._velocity_cap, self._curve_cap * share)
        bent = self._bend[:, :, None] * (cap[:, None] * LEVEL_PARTS)
        room = (self._room * share)[:, :, None]
        # The most that b may gain forwards, and backwards, per unit of s / 2: by direction, sample and level.
        bound = np.empty((2, len(cap), LEVELS + 1))
        (room + bent).min(axis=0, out=bound[0])
        (room - bent).min(axis=0, out=bound[1])
        slope = (bound[:, :, 1:] - bound[:, :, :-1]) * (LEVELS / cap)[:, None]
        start = bound[:, :, :-1] - slope * (cap[:, None] * LEVEL_PARTS[:-1])
        # A step takes b to constant + factor * b, with its own two numbers for each level.
        constant = (self._grow * start).reshape(2, -1).tolist()
        factor = (1.0 + self._grow * slope).reshape(2, -1).tolist()
        to_level: list[float] = (LEVELS * (1.0 - TINY) / cap).tolist()
        speeds_squared: list[float] = cap.tolist()
        speeds_squared[0] = speeds_squared[-1] = 0.0
        order = range(len(cap))
        _sweep(speeds_squared, order[::-1], to_level, constant[1], factor[1])
        _sweep(speeds_squared, order, to_level, constant[0], factor[0])
        return [math.sqrt(b) for b in speeds_squared], float(bound[0, 0, 0]), float(bound[1, -1, 0])


def _sweep(
    b: list[float], order: range, to_level: list[float], constant: list[float], factor: list[float]
) -> None:
    """Lower b, in this order of samples, to what can be reached from the sample before."""
    here = order[0]
    x = b[here]
    for i in order[1:]:
        row = LEVELS * here + int(x * to_level[here])
        x = constant[row] + factor[row] * x
        here = i
        if x < b[i]:
            b[i] = x = max(x, 0.0)
        else:
            x = b[i]
