"""LIN: joints along a straight line of the TCP, the redundancy going evenly from start to target.

A line stays on the branch it starts on. Where it goes exactly through a singular pose, as when A6 passes zero
in the plane of the arm, it goes on along the branch that continues it without a jump of any joint.
"""

from typing import NamedTuple

import numpy as np

from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.path import Joints, PathSamples
from iiwa_sim.motion.tcp_line import TcpLine
from iiwa_sim.robot.inverse import Inverse

SAMPLES = 65  # to begin with; doubled until the joints turn little enough from one to the next
MOST_SAMPLES = 1025
LARGEST_STEP_RAD = 0.08
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
        self, inverse: Inverse, start: Joints, line: TcpLine, target_redundancy: float, status: int
    ) -> None:
        """From `start` (rad), where the line begins, on the branch `status`.

        Raises `LineOutOfReach` and `SingularLine`.
        """
        self._inverse = inverse
        self._line = line
        self._redundancy = inverse.redundancy(start)
        self._redundancy_way = target_redundancy - self._redundancy
        self._stretches = [_Stretch(0.0, status, start)]
        self.samples = self._sample()
        self.end: Joints = tuple(self.samples.q[-1].tolist())

    def joints(self, s: float) -> Joints:
        """See `Path`."""
        if s >= 1.0:
            return self.end
        k = len(self._stretches) - 1
        while self._stretches[k].s > s:
            k -= 1
        return self._joints(s, self._stretches[k])

    def _joints(self, s: float, stretch: _Stretch) -> Joints:
        redundancy = self._redundancy + s * self._redundancy_way
        joints = self._inverse.joints(self._line.flange(s), redundancy, stretch.status, stretch.seed)
        if joints is None:
            raise LineOutOfReach(s)
        return joints

    def _sample(self) -> PathSamples:
        """The line at as many samples as it needs for the joints to turn little between them."""
        count = SAMPLES
        while True:
            s = np.linspace(0.0, 1.0, count)
            q = self._positions(s)
            steps = np.abs(np.diff(q, axis=0))
            jumps = np.flatnonzero(steps.max(axis=1) > LARGEST_STEP_RAD)
            if not len(jumps):
                return PathSamples.from_positions(q)
            place = int(jumps[0])
            if self._cross(s[place], s[place + 1], tuple(q[place].tolist())):
                continue
            if count >= MOST_SAMPLES:
                raise SingularLine(float(s[place]), int(steps[place].argmax()))
            count = 2 * count - 1

    def _positions(self, s: Array) -> Array:
        """Joint positions (m, n) at equally spaced values of s (m,), 0 and 1 included."""
        rotations, translations = self._line.flanges(s)
        redundancies = self._redundancy + s * self._redundancy_way
        last = self._stretches[-1]
        statuses = np.full(len(s), last.status)
        for stretch, following in zip(self._stretches, self._stretches[1:], strict=False):
            statuses[(s >= stretch.s) & (s < following.s)] = stretch.status
        status = last.status if len(self._stretches) == 1 else statuses
        q = self._inverse.joints_batch(rotations, translations, redundancies, status, last.seed)
        unreached = np.isnan(q).any(axis=1)
        if unreached.any():
            raise LineOutOfReach(float(s[unreached.argmax()]))
        # A line may end where a joint is free: there it keeps the position that it comes with.
        seed = tuple((4.0 * q[-2] - 6.0 * q[-3] + 4.0 * q[-4] - q[-5]).tolist())
        q[0] = self._stretches[0].seed
        q[-1] = self._joints(1.0, _Stretch(1.0, last.status, seed))
        return q

    def _cross(self, before: float, after: float, coming: Joints) -> bool:
        """Whether the line goes through a singular pose between two samples; there it changes its branch.

        `coming` are the joints at the sample `before`.
        """
        own = self._stretches[-1]
        if own.s > before:
            return False
        for status in self._inverse.statuses:
            other = _Stretch(after, status, coming)
            try:
                going = self._joints(after, other)
            except LineOutOfReach:
                continue
            if status == own.status or _distance(going, coming) > LARGEST_STEP_RAD:
                continue
            low, high = before, after
            for _ in range(HALVINGS):
                s = 0.5 * (low + high)
                part = (s - before) / (after - before)
                expected = tuple([a + part * (b - a) for a, b in zip(coming, going, strict=True)])
                on_own, on_other = self._joints(s, own), self._joints(s, other)
                if _distance(on_own, expected) <= _distance(on_other, expected):
                    low = s
                else:
                    high = s
            if status in self._inverse.merging_statuses(self._joints(low, own), MEETING):
                self._stretches.append(_Stretch(high, status, coming))
                return True
        return False


def _distance(a: Joints, b: Joints) -> float:
    return max([abs(x - y) for x, y in zip(a, b, strict=True)])
