"""The timing of a chain of paths within velocity, acceleration and jerk limits of all joints.

The fastest run without jerk limits (`profile`) goes through a moving average (`smooth`). Its window is chosen
so that a lone change of acceleration keeps the jerk limit; where several coincide, or the path curves within
a window, limits can still be passed. There the run is planned again with a smaller share of the limits.
"""

from typing import NamedTuple

import numpy as np

from iiwa_sim.motion.bounds import Bounds, Loads
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.profile import Profile
from iiwa_sim.motion.slices import Slices
from iiwa_sim.motion.smooth import SmoothStates, SmoothTiming

ROUNDS = 12  # times to plan again with smaller shares
HARDER = (1.08, 1.15, 1.2, 1.3)  # relief beyond what seems to be needed, the first times and then
SHARES_ONLY = 3  # times; then speeds are lowered, too, where accelerations and jerks are too large
FASTEST = 0.999  # of velocity limits
LARGEST_RELIEF = 4.0  # at once: more would be too much where several loads coincide
KEPT = 0.99  # of the limits must be kept: the rest is for what interpolation between samples may hide
SLOWINGS = 12  # times that a run from rest is made slower where shares do not help
SLOWING = 0.6
SOONEST_S = 0.01  # a profile goes on from its next knot, or from where it is if that is farther off
SAME_S = 1e-9  # knots that are closer are one


def from_rest(bounds: Bounds, window_s: float) -> Slices[tuple[SmoothTiming, Bounds]]:
    """A timing over all of the bounds from rest to rest, and these with the shares that it took.

    Raises ArithmeticError where none is found, however slow.
    """
    start = _Start(float(bounds.s[0]), 0.0, [], [], 0.0)
    for _ in range(SLOWINGS):
        planned = yield from _planned(bounds, start, 0.0, window_s)
        if planned is not None:
            return planned
        cap = np.minimum(bounds.velocity_cap, bounds.curve_cap * bounds.share)
        bounds = bounds._replace(share=SLOWING * bounds.share, velocity_cap=SLOWING * cap)
    raise ArithmeticError("no timing keeps the limits")


def going_on(
    timing: SmoothTiming, bounds: Bounds, now_s: float, time_s: float
) -> Slices[tuple[SmoothTiming, Bounds] | None]:
    """The same from another timing at a time, whose first part it keeps; None where none is found.

    The bounds begin where the robot is now, or before.
    """
    knot = timing.next_knot(time_s)
    if knot is None or knot[0] > time_s + SOONEST_S:
        knot = (time_s, *timing.front(time_s))
    start_s, s, speed = knot
    if s >= bounds.s[-1]:
        return None
    done = timing.knots_between(now_s - timing.window_s, start_s - SAME_S)
    return (yield from _planned(bounds, _Start(s, speed, *done), time_s, timing.window_s))


class _Start(NamedTuple):
    """Where a profile goes on: there"""

    s: float
    speed: float
    positions: list[float]
    """after these knots,"""
    speeds: list[float]
    start_s: float
    """the first of which is at this time."""


def _planned(
    bounds: Bounds, start: _Start, time_s: float, window_s: float
) -> Slices[tuple[SmoothTiming, Bounds] | None]:
    """A timing that keeps the limits from a time on; a slice for each round."""
    loads = Loads(bounds)
    for attempt in range(ROUNDS):
        knots = Profile(bounds.starting(start.s)).fastest(start.speed, window_s)
        if knots is None:
            return None
        timing = SmoothTiming(start.positions + knots[0], start.speeds + knots[1], window_s, start.start_s)
        states = timing.states(loads.jumps, time_s)
        velocity, load = loads.of(states.s, states.ds, states.dds, states.ddds)
        if velocity.max() <= FASTEST and load.max() <= KEPT:
            return timing, bounds
        harder = HARDER[min(attempt, len(HARDER) - 1)]
        relief = _relief(bounds.s, states, load / KEPT, harder)
        slower, cap = _relief(bounds.s, states, (velocity / FASTEST) ** 2, harder), bounds.velocity_cap
        if attempt >= SHARES_ONLY:
            slower, cap = np.minimum(slower, relief), np.minimum(cap, bounds.curve_cap * bounds.share)
        cap = np.where(slower < 1.0, cap * slower, bounds.velocity_cap)
        bounds = bounds._replace(share=bounds.share * relief, velocity_cap=cap)
        yield
    return None


def _relief(s: Array, states: SmoothStates, load: Array, harder: float) -> Array:
    """The factors (m,) that take from the states (k,) what they have too much."""
    over = np.flatnonzero(load > 1.0)
    relief = np.ones(len(s))
    if len(over):
        # The steps between samples that each window touches; a sample gets the relief of the steps beside it.
        touched = s[1:] > states.window_start[over, None]
        touched &= s[:-1] < states.window_end[over, None]
        of_steps = np.where(touched, 1.0 / (harder * load[over, None].clip(max=LARGEST_RELIEF)), 1.0).min(
            axis=0
        )
        relief[:-1] = of_steps
        np.minimum(relief[1:], of_steps, out=relief[1:])
    return relief
