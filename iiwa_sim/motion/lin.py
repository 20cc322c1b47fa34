"""LIN: joints along a straight line of the TCP, the redundancy going evenly from start to target.

A line stays on the branch it starts on. Where it goes exactly through a singular pose, as when A6 passes zero
in the plane of the arm, it goes on along the branch that continues it without a jump of any joint. A joint
goes on through half a turn, too, where the inverse starts again at the other end.
"""

from math import pi, tau
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.motion.differences import EVEN_SAMPLES
from iiwa_sim.motion.limits import STANDSTILL_RAD, Array, JointLimits
from iiwa_sim.motion.sampled_path import Joints, PathSamples
from iiwa_sim.motion.tcp_line import TcpLine
from iiwa_sim.robot.inverse import Inverse
from iiwa_sim.robot.turns import continued, continued_rows

MOST_SAMPLES = 400
SMALLEST_STEP = 1e-4  # between samples
PARTS = 4  # into which a step is split
FREE_AT_START = 1e-5  # rad or m from a singular pose, where a line is taken to start in it
FREE_AT_END = 2e-8  # or to end in it
TAIL = 1e-3  # of such a line, at that end of it
LARGEST_MISMATCH_RAD = 1e-4  # of a free joint at the start: so much is made up for on the way
LARGEST_STEP_RAD = 0.08  # of a joint from one sample to the next
LARGEST_UNCERTAINTY = 0.5  # see PathSamples; the real error is some percent of this estimate
HALVINGS = 50  # of a step, to find where branches meet
MEETING = 1e-9  # rad or m from a singular pose, where the line is taken to go through it


class LineOutOfReach(Exception):
    """From `s` on the arm cannot reach the line on the branch it is on."""

    def __init__(self, s: float) -> None:
        super().__init__(f"at s = {s}")
        self.s = s


class SingularLine(Exception):
    """At `s` the line comes so close to a singular pose that the joint (by index) would have to jump."""

    def __init__(self, s: float, joint: int) -> None:
        super().__init__(f"at s = {s}, joint {joint}")
        self.s = s
        self.joint = joint


class _Stretch(NamedTuple):
    """From this s on the line is on this branch; a joint that is free keeps its position in the seed."""

    s: float
    status: int
    seed: Joints


class Line:
    """Joints along a line of the TCP."""

    def __init__(
        self,
        inverse: Inverse,
        limits: JointLimits,
        start: Joints,
        line: TcpLine,
        target_redundancy: float,
        status: int,
    ) -> None:
        """From `start` (rad), where the line begins, on the branch `status`.

        The limits are those of full speed; they tell how closely the line has to be sampled.
        Raises `LineOutOfReach` and `SingularLine`.
        """
        self._inverse = inverse
        self._limits = limits
        self._line = line
        self.tcp_length_m = line.length_m
        self._redundancy = inverse.redundancy(start)
        self._redundancy_way = target_redundancy - self._redundancy
        self._stretches = [_Stretch(0.0, status, start)]
        self._head: Array | None = None
        self._tail: Array | None = None
        self.samples = self._sample()
        self.end: Joints = tuple(self.samples.q[-1].tolist())
        # Elsewhere the inverse gives all positions as they are.
        self._beyond_half_turn = bool(np.abs(self.samples.q).max() > pi - LARGEST_STEP_RAD)

    def joints(self, s: float) -> Joints:
        """See `Path`."""
        if s >= 1.0:
            return self.end
        if self._tail is not None and s > 1.0 - TAIL:
            return _on_polynomial(self._tail, (1.0 - s) / TAIL)
        if self._head is not None and s < TAIL:
            return _on_polynomial(self._head, s / TAIL)
        k = len(self._stretches) - 1
        while self._stretches[k].s > s:
            k -= 1
        joints = self._joints(s, self._stretches[k])
        return continued(joints, self._sampled(s)) if self._beyond_half_turn else joints

    def joints_along(self, s: Array) -> Array:
        """See `Path`."""
        singular = self._head is not None or self._tail is not None or len(self._stretches) > 1
        if singular or s[-1] >= 1.0:
            return np.array([self.joints(x) for x in s.tolist()])
        joints = self._positions(s)
        if self._beyond_half_turn:
            places = self.samples.s.searchsorted(s, side="right") - 1
            return continued_rows(joints, self.samples.q[places])
        return joints

    def _sampled(self, s: float) -> Joints:
        """Joint positions at the sample before s."""
        place = int(self.samples.s.searchsorted(s, side="right")) - 1
        return tuple(self.samples.q[place].tolist())

    def _joints(self, s: float, stretch: _Stretch) -> Joints:
        redundancy = self._redundancy + s * self._redundancy_way
        joints = self._inverse.joints(self._line.flange(s), redundancy, stretch.status, stretch.seed)
        if joints is None:
            raise LineOutOfReach(s)
        return joints

    def _sample(self) -> PathSamples:
        """The line at as many samples as it takes to resolve how the joints move."""
        s = np.linspace(0.0, 1.0, EVEN_SAMPLES)
        q = self._from_start_to_end(s)
        while True:
            steps = np.abs(np.diff(q, axis=0)).max(axis=1)
            split = steps > LARGEST_STEP_RAD
            if split.any():
                place = int(split.argmax())
                if self._cross(s[place], s[place + 1], tuple(q[place].tolist())):
                    q = self._from_start_to_end(s)
                    continue
            else:
                samples = PathSamples.of(s, q)
                if steps.sum() < STANDSTILL_RAD:
                    return samples
                unsure = samples.uncertainty(self._limits) > LARGEST_UNCERTAINTY
                if not unsure.any():
                    return samples
                split = unsure[1:] | unsure[:-1]
            if np.diff(s)[split].min() < SMALLEST_STEP or len(s) > MOST_SAMPLES:
                place = int(np.where(split, steps, 0.0).argmax())
                raise SingularLine(float(s[place]), int(np.abs(q[place + 1] - q[place]).argmax()))
            between = _between(s, split)
            s, q = np.concatenate([s, between]), np.concatenate([q, self._positions(between)])
            order = s.argsort()
            s, q = s[order], _without_turns(q[order])

    def _from_start_to_end(self, s: Array) -> Array:
        """Joint positions (m, n) at rising values of s (m,), 0 and 1 included."""
        q = self._positions(s)
        q[0] = self._stretches[0].seed
        q = _without_turns(q)
        if len(self._inverse.merging_statuses(q[-1].tolist(), FREE_AT_END)) > 1:
            # A joint that is free at the end keeps the position that it comes with. The inverse cannot tell
            # it, and next to the end the last digits of the target decide on it.
            last = self._stretches[-1]
            tail = self._polynomial(1.0, -TAIL, last, tuple(q[-2].tolist()))
            coming: Joints = tuple(tail[0].tolist())
            end = continued(self._joints(1.0, last._replace(seed=coming)), coming)
            self._tail = _through(tail, end)
            q[-1] = end
        start = self._stretches[0]
        if len(self._inverse.merging_statuses(start.seed, FREE_AT_START)) > 1:
            # A joint that is free at the start must have the position that it leaves with.
            head = self._polynomial(0.0, TAIL, start, start.seed)
            mismatch = np.abs(head[0] - start.seed)
            if mismatch.max() > LARGEST_MISMATCH_RAD:
                raise SingularLine(0.0, int(mismatch.argmax()))
            self._head = _through(head, start.seed)
        return q

    def _polynomial(self, end: float, inwards: float, stretch: _Stretch, beside: Joints) -> Array:
        """Coefficients (4, n) of the joints over (s - end) / inwards, from what lies inwards of the end.

        Joint positions are near those at the sample `beside`.
        """
        near = np.array([continued(self._joints(end + k * inwards, stretch), beside) for k in (1, 2, 3, 4)])
        coefficients: Array = np.linalg.solve(np.vander([1.0, 2.0, 3.0, 4.0], increasing=True), near)
        return coefficients

    def _positions(self, s: Array) -> Array:
        """Joint positions (m, n) at values of s (m,)."""
        rotations, translations = self._line.flanges(s)
        redundancies = self._redundancy + s * self._redundancy_way
        stretches = self._stretches
        status: int | NDArray[np.int64] = stretches[-1].status
        if len(stretches) > 1:
            starts = np.array([stretch.s for stretch in stretches])
            places = starts.searchsorted(s, side="right") - 1
            status = np.array([stretch.status for stretch in stretches])[places]
        q = self._inverse.joints_batch(rotations, translations, redundancies, status, stretches[-1].seed)
        unreached = np.isnan(q).any(axis=1)
        if unreached.any():
            raise LineOutOfReach(float(s[unreached.argmax()]))
        return q

    def _cross(self, before: float, after: float, coming: Joints) -> bool:
        """Whether the line goes through a singular pose between two samples; there it changes its branch.

        `coming` are the joints at the sample `before`.
        """
        own = self._stretches[-1]
        if own.s > before or (before == 0.0 and len(self._inverse.merging_statuses(coming)) > 1):
            return False  # just crossed, or the line starts in a singular pose
        for status in self._inverse.statuses:
            other = _Stretch(after, status, coming)
            try:
                going = continued(self._joints(after, other), coming)
            except LineOutOfReach:
                continue
            if status == own.status or _distance(going, coming) > LARGEST_STEP_RAD:
                continue
            low, high = before, after
            for _ in range(HALVINGS):
                s = 0.5 * (low + high)
                part = (s - before) / (after - before)
                expected = tuple([a + part * (b - a) for a, b in zip(coming, going, strict=True)])
                on_own = continued(self._joints(s, own), expected)
                on_other = continued(self._joints(s, other), expected)
                if _distance(on_own, expected) <= _distance(on_other, expected):
                    low = s
                else:
                    high = s
            if status in self._inverse.merging_statuses(self._joints(low, own), MEETING):
                self._stretches.append(_Stretch(before, own.status, coming))
                self._stretches.append(_Stretch(high, status, coming))
                return True
        return False


def _without_turns(q: Array) -> Array:
    """Joint positions (m, n) along a line, without the whole turns between one and the next."""
    steps = np.diff(q, axis=0)
    if np.abs(steps).max() <= pi:
        return q
    turns = np.zeros_like(q)
    turns[1:] = np.cumsum(np.round(steps / tau), axis=0)
    unturned: Array = q - tau * turns
    return unturned


def _between(s: Array, split: NDArray[np.bool_]) -> Array:
    """New samples in those steps between samples s (m,) that are to be split (m - 1,)."""
    steps = np.diff(s)[split, None]
    between: Array = s[:-1][split, None] + steps * (np.arange(1, PARTS) / PARTS)
    return between.ravel()


def _through(polynomial: Array, end: Joints) -> Array:
    """The polynomial (4, n), with what it misses of the end at 0 added smoothly from 1 to there."""
    through: Array = polynomial + np.outer((1.0, -3.0, 3.0, -1.0), np.subtract(end, polynomial[0]))
    return through


def _on_polynomial(polynomial: Array, x: float) -> Joints:
    a, b, c, d = polynomial
    return tuple((a + x * (b + x * (c + x * d))).tolist())


def _distance(a: Joints, b: Joints) -> float:
    return max([abs(x - y) for x, y in zip(a, b, strict=True)])
