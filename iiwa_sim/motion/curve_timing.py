"""The timing of a curved path within velocity, acceleration and jerk limits of all joints.

The fastest run without jerk limits (`phase_plane`) goes through a moving average (`smooth`). Its window is
chosen so that a lone change of acceleration keeps the jerk limit; where several coincide, or the path curves
within a window, limits can still be passed. There the run is planned again with a smaller share of the
acceleration limits, a few times; what then remains is taken away by running the whole move slower by some
percent.
"""

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.motion.path import PathSamples
from iiwa_sim.motion.phase_plane import PhasePlane
from iiwa_sim.motion.smooth import SmoothStates, SmoothTiming

WINDOW = 1.2  # of the time in which full jerk builds up full acceleration; see docs/motion.md for the choice
ROUNDS = 2  # times to plan again with smaller shares
CLOSE = 1.03  # where slowing by less suffices, it is not planned again
SHORTEST_RAMP = 1e-12  # of the way: knots that are closer are one
AIM = 0.99  # of the limits: what interpolation between samples may hide


def plan_timing(samples: PathSamples, limits: JointLimits) -> SmoothTiming:
    """A timing from rest to rest that keeps the limits, as far as interpolation between samples tells."""
    plane = PhasePlane(samples, limits)
    loads = _Loads(samples, limits)
    window_s = WINDOW * float((limits.acceleration / limits.jerk).max())
    share = np.full(len(samples.s), AIM)
    best: SmoothTiming | None = None
    best_slowing = 1.0
    for _ in range(ROUNDS + 1):
        timing = _run(samples, plane, share, window_s)
        states = timing.extremes()
        load, slowing = loads.of(states)
        if best is None or timing.duration_s * slowing < best.duration_s * best_slowing:
            best, best_slowing = timing, slowing
        over = np.flatnonzero(load > 1.0)
        if slowing < CLOSE or not len(over):
            break
        share = share * _relief(samples, states, load, over)
    assert best is not None
    return best.slower(best_slowing)


def _run(samples: PathSamples, plane: PhasePlane, share: Array, window_s: float) -> SmoothTiming:
    """The fastest run with these shares, smoothed.

    From one sample to the next its acceleration is constant. In the first and last step this would waste time
    where full acceleration reaches the speed of the next sample earlier, so these two get a knot in between.
    """
    speeds, take_off, braking = plane.fastest(share)
    positions: list[float] = samples.s.tolist()
    ramp = speeds[-2] ** 2 / (2.0 * braking) if braking > 0.0 else 1.0
    if SHORTEST_RAMP < ramp < 0.9 * (positions[-1] - positions[-2]):
        positions.insert(-1, positions[-1] - ramp)
        speeds.insert(-1, speeds[-2])
    ramp = speeds[1] ** 2 / (2.0 * take_off) if take_off > 0.0 else 1.0
    if SHORTEST_RAMP < ramp < 0.9 * positions[1]:
        positions.insert(1, ramp)
        speeds.insert(1, speeds[1])
    return SmoothTiming(np.array(positions), np.array(speeds), window_s)


class _Loads:
    """How much of the limits a motion along a path takes."""

    def __init__(self, samples: PathSamples, limits: JointLimits) -> None:
        velocity, acceleration, jerk = (limit[:, None] for limit in limits)
        dq, ddq, dddq = samples.dq.T, samples.ddq.T, samples.dddq.T
        # Joints come first: reductions over joints then run along memory.
        accelerations = [dq / acceleration, ddq / acceleration]
        shape = [dq / velocity, *accelerations, dq / jerk, 3.0 * ddq / jerk, dddq / jerk]
        self._s = samples.s
        self._shape = np.concatenate(shape)
        self._slope = np.diff(self._shape) / np.diff(samples.s)

    def of(self, states: SmoothStates) -> tuple[Array, float]:
        """The load of each state (k,), and how much slower the whole must run for all limits to hold.

        A load counts like an acceleration: a jerk of r times its limit goes away if accelerations shrink by
        r^(2/3).
        """
        k = self._s[1:-1].searchsorted(states.s, side="right")
        here = self._slope.take(k, axis=1)
        here *= states.s - self._s.take(k)
        here += self._shape.take(k, axis=1)
        v1, a1, a2, j1, j2, j3 = here.reshape(6, -1, len(k))
        _, ds, dds, after, _, _ = states
        square = ds * ds
        velocity = float((np.abs(v1).max(axis=0) * ds).max())
        acceleration = np.abs(a1 * dds + a2 * square).max(axis=0)
        curving = j2 * (ds * dds) + j3 * (square * ds)
        before = np.concatenate([after[:1], after[:-1]])
        jerk = np.maximum(np.abs(j1 * after + curving), np.abs(j1 * before + curving)).max(axis=0)
        slowing = max(velocity, float(acceleration.max()) ** (1 / 2), float(jerk.max()) ** (1 / 3))
        return np.maximum(acceleration, jerk ** (2 / 3)), max(slowing / AIM, 1.0)


def _relief(samples: PathSamples, states: SmoothStates, load: Array, over: NDArray[np.intp]) -> Array:
    """The factors (m,) for the shares that take from the states `over` what they have too much."""
    # The steps between samples that each window touches; a sample gets the relief of the steps beside it.
    touched = samples.s[1:] > states.window_start[over, None]
    touched &= samples.s[:-1] < states.window_end[over, None]
    of_steps = np.where(touched, 1.0 / load[over, None], 1.0).min(axis=0)
    relief = np.ones(len(samples.s))
    relief[:-1] = of_steps
    np.minimum(relief[1:], of_steps, out=relief[1:])
    return relief
