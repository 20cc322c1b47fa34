"""What the limits allow along a path: bounds on its speed and acceleration at samples.

The state is b = (ds/dt)^2 at the samples of a path. A joint with q', q'' bounds it twice: its velocity limit
caps b, and its acceleration q' dds + q'' b bounds dds = (db/ds)/2 from both sides, by straight lines in b
(Bobrow, Dubowsky, Gibson 1985).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.motion.sampled_path import PathSamples

TINY = 1e-9
CURVE_JERK = 0.7  # of jerk limits may be taken by the curve alone
AIM = 0.98  # of acceleration limits, and
SPEED_AIM = 0.995  # of squares of velocity limits, is planned with at first
JUMP = 1e-3  # of loads at a sample
BESIDE_S = 1e-9
SAME = 1e-9  # parts of a step: samples that are closer are one


class Bounds(NamedTuple):
    """The bounds at m rising values of s. Joints come first, samples second: reductions over joints then run
    along memory. From each sample to the next all of it is taken to go straight."""

    s: Array
    """(m,)"""
    room: Array
    """(n, m): a joint allows dds up to `room + bend * b` and down to `-room + bend * b`,"""
    bend: Array
    """(n, m),"""
    velocity_cap: Array
    """and b up to this (m,)."""
    curve_cap: Array
    """Beyond this b (m,) the upper bound of one joint lies below the lower bound of another."""
    share: Array
    """The part of each acceleration limit that is planned with, and of the caps (m,), above 0 up to 1."""
    loads: Array
    """What ds, dds and ddds take of the limits at the beginning of each step (6 n, m - 1), see `Loads`,"""
    slopes: Array
    """and how these change per unit of s within the step."""

    @classmethod
    def of(cls, samples: PathSamples, limits: JointLimits, velocity: Array) -> "Bounds":
        """`velocity` are the limits at each sample (m, n) or at all of them (n,)."""
        dq, ddq, dddq = (np.ascontiguousarray(part.T) for part in (samples.dq, samples.ddq, samples.dddq))
        v = velocity.T if velocity.ndim == 2 else velocity[:, None]
        a, j = limits.acceleration[:, None], limits.jerk[:, None]
        rate = np.maximum(np.abs(dq), TINY * np.abs(dq).max() + 1e-300)
        room = a / rate
        bend = -np.sign(dq) * ddq / rate
        closing = np.maximum(bend[None] - bend[:, None], TINY)
        curve_cap = ((room[None] + room[:, None]) / closing).min(axis=(0, 1))
        jerk = np.maximum((np.abs(dddq) / j).max(axis=0), 1e-300)
        curve_cap = np.minimum(curve_cap, (CURVE_JERK / jerk) ** (2 / 3))
        fastest = rate + _hidden(samples.s, dq, dddq)
        loads = np.concatenate(
            [np.copysign(fastest, dq) / v, dq / a, ddq / a, dq / j, 3.0 * ddq / j, dddq / j]
        )
        return cls(
            samples.s,
            room,
            bend,
            SPEED_AIM * _straight_below((v / fastest).min(axis=0)),
            curve_cap,
            np.full(len(samples.s), AIM),
            loads[:, :-1],
            np.diff(loads) / np.diff(samples.s),
        )

    def moved(self, by: float) -> "Bounds":
        """With `by` added to s."""
        return self._replace(s=self.s + by)

    def starting(self, start: float) -> "Bounds":
        """The part from an s on."""
        if start <= self.s[0]:
            return self
        step = int(self.s.searchsorted(start, side="right")) - 1
        width = self.s[step + 1] - self.s[step]
        if self.s[step + 1] - start < SAME * width:
            step += 1
        rest = Bounds(*(array[..., step:] for array in self))
        return rest._with(0, 1, start)

    def upto(self, end: float) -> "Bounds":
        """The part up to an s."""
        if end >= self.s[-1]:
            return self
        step = int(self.s.searchsorted(end)) - 1
        if end - self.s[step] < SAME * (self.s[step + 1] - self.s[step]):
            step -= 1
        steps = (self.loads[:, : step + 1], self.slopes[:, : step + 1])
        samples = (array[..., : step + 2] for array in self[:6])
        rest = Bounds._make((*samples, *steps))
        return rest._with(-1, -2, end)

    def gentler(self, start: float, end: float, factor: float) -> "Bounds":
        """With a smaller share of the acceleration limits from one s to another."""
        parts = []
        if start > self.s[0]:
            parts.append(self.upto(start))
        middle = self.starting(start).upto(end)
        parts.append(middle._replace(share=middle.share * factor))
        if end < self.s[-1]:
            parts.append(self.starting(end))
        return joined(parts)

    def _with(self, sample: int, other: int, s: float) -> "Bounds":
        """With a sample, the first or last, moved within its step to s."""
        part = (s - self.s[sample]) / (self.s[other] - self.s[sample])
        arrays = [array.copy() for array in self]
        for array in arrays[:6]:
            array[..., sample] += part * (array[..., other] - array[..., sample])
        if sample == 0:
            arrays[6][:, 0] += self.slopes[:, 0] * (s - self.s[0])
        return Bounds(*arrays)


def joined(parts: Sequence[Bounds]) -> Bounds:
    """Bounds of paths that go on from one another: the last sample of one is the first of the next.

    There the steps on both sides keep their own loads: the third derivative may jump.
    """
    if len(parts) == 1:
        return parts[0]
    first = parts[0]
    samples = [
        np.concatenate([first[i], *(part[i][..., 1:] for part in parts[1:])], axis=-1) for i in range(6)
    ]
    steps = [np.concatenate([part[i] for part in parts], axis=1) for i in (6, 7)]
    return Bounds(*samples, *steps)


class Loads:
    """How much of the limits a motion along a path takes."""

    def __init__(self, bounds: Bounds) -> None:
        self._inner = bounds.s[1:-1]
        self._s = bounds.s
        self._loads = bounds.loads
        self._slopes = bounds.slopes
        ends = bounds.loads[:, :-1] + bounds.slopes[:, :-1] * np.diff(bounds.s[:-1])
        jumps = self._inner[(np.abs(ends - bounds.loads[:, 1:]) > JUMP).any(axis=0)]
        self.jumps: Array = np.sort(np.concatenate([jumps - BESIDE_S, jumps + BESIDE_S]))
        """Both sides of the samples where loads jump: to be looked at."""

    def of(self, s: Array, ds: Array, dds: Array, ddds: Array) -> tuple[Array, Array]:
        """Of velocity limits (k,), and of acceleration and jerk limits together (k,), at k states.

        ddds is constant from a state to the next. A jerk of r times its limit goes away if accelerations
        shrink by r^(2/3): so much it counts.
        """
        k = self._inner.searchsorted(s, side="right")
        here = self._slopes.take(k, axis=1)
        here *= s - self._s.take(k)
        here += self._loads.take(k, axis=1)
        v1, a1, a2, j1, j2, j3 = here.reshape(6, -1, len(k))
        square = ds * ds
        velocity: Array = np.abs(v1).max(axis=0) * ds
        acceleration = np.abs(a1 * dds + a2 * square).max(axis=0)
        curving = j2 * (ds * dds) + j3 * (square * ds)
        before = np.concatenate([ddds[:1], ddds[:-1]])
        jerk = np.maximum(np.abs(j1 * ddds + curving), np.abs(j1 * before + curving)).max(axis=0)
        return velocity, np.maximum(acceleration, jerk ** (2 / 3))


def _hidden(s: Array, dq: Array, dddq: Array) -> Array:
    """By how much a joint may be faster beside a sample (n, m) than what goes straight between them says."""
    steps = np.diff(s)
    widest = np.maximum(np.append(steps, 0.0), np.append(0.0, steps))
    hidden: Array = np.maximum(-dddq * np.sign(dq), 0.0) * (widest * widest / 8.0)
    return hidden


def _straight_below(speed: Array) -> Array:
    """Squares (m,) of speeds at samples, smaller where that is needed: what goes straight from one to the
    next is then no more than what the inverse of the speed allows that goes straight."""
    square, slowness = speed * speed, 1.0 / speed
    between = 8.0 / ((slowness[1:] + slowness[:-1]) ** 2 * (square[1:] + square[:-1]))
    below: Array = square * np.minimum(np.append(between, 1.0), np.append(1.0, between))
    return below
