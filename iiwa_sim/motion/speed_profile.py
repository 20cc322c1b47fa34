"""Plans speed profiles with `profile_kernel.SpeedProfile`, and yields between calls of bounded work."""

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.profile_kernel import UNIT_S, SpeedProfile
from iiwa_sim.motion.queue.chain_kernel import JointPath
from iiwa_sim.motion.slices import Slices

WORK = 1000
"""Budget of one call, in interior-point steps of a segment: some 0.4 ms."""
AT_FIRST = 5
"""Most such calls in the tick in which a move sets out alone."""
ENOUGH = 0.03
"""Duality gap that ends a solution, as a part of the duration."""
NOTHING = np.empty(0)


def sampled(path: JointPath, x: Array, old: Array = NOTHING, kept: int = 0) -> Slices[SpeedProfile]:
    """Return the profile, not yet solved, of a path along which x is a cubic B-spline (N + 3,).

    `old` are coefficients of the profile over the first `kept` segments; two of them stay.
    """
    profile = SpeedProfile(path, x, old, kept)
    while not profile.sample(WORK):
        yield
    return profile


def guess(profile: SpeedProfile, durations_s: Array) -> None:
    """Write a first guess over the last segments, of nominal durations (M,)."""
    profile.guess(durations_s / UNIT_S)


def fastest(profile: SpeedProfile, enough: float = ENOUGH) -> Slices[bool]:
    """Bring a profile from its first guess close to the fastest one. Return whether it keeps all limits."""
    profile.begin(enough)
    while not profile.advance(WORK):
        yield
    return bool(profile.keeps_limits)


def quick(profile: SpeedProfile, durations_s: Array) -> bool:
    """Do as `fastest`, from rest to rest, in at most `AT_FIRST` calls; else slow the profile down.

    Return whether it is close to the fastest one.
    """
    profile.begin(ENOUGH)
    for _ in range(AT_FIRST):
        if profile.advance(WORK):
            if profile.keeps_limits:
                return True
            guess(profile, durations_s)
            break
    profile.slow_down()
    return False
