"""Lines that are not regular as a whole: that change their branch, or come near a singular pose on their way.

Such a line is looked at in samples until no joint goes far between two. Where one would jump, the line may
go exactly through a singular pose, as when A6 passes zero in the plane of the arm: it goes on along that
branch that continues it without a jump. Next to such a place, and next to an end in a singular pose, the last
digits of the target decide where a joint is; there a polynomial goes on from what lies beside.
"""

from collections.abc import Sequence
from math import pi, tau
from typing import NamedTuple

import numpy as np

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import STANDSTILL_RAD, Array
from iiwa_sim.motion.path.fit_kernel import NODES_AND_WEIGHTS
from iiwa_sim.motion.path.line_kernel import FREE_AT_START, LineJoints, LineOutOfReach, SingularLine
from iiwa_sim.motion.path.piecewise_kernel import Polynomial
from iiwa_sim.motion.path.splice import at_border, splice
from iiwa_sim.robot.arm_kernel import continued

EVEN_SAMPLES = 33
MOST_SAMPLES = 400
SMALLEST_STEP = 1e-4  # between samples
PARTS = 4  # into which a step is split
LARGEST_STEP_RAD = 0.08  # of a joint from one sample to the next
FREE_AT_END = 2e-8  # rad or m from a singular pose, where a line is taken to end in it
BESIDE = 1e-3  # in s from such an end: from there on inwards a joint tells where it comes from, or goes
LARGEST_MISMATCH_RAD = 1e-4  # of a free joint at the start: so much is made up for on the way
MEETING = 1e-9  # rad or m from a singular pose, where the line is taken to go through it
CHECKED = (0.1, 0.3, 0.5, 0.7, 0.9)
LARGEST_OFF = 1e-6  # m, or in elements of a rotation, beside a singular pose
GAP = 0.01  # in s, beside a singular pose: there joints are as smooth as beyond
SMALLEST_PIECE = 5e-5  # in s


class _Stretch(NamedTuple):
    """A part of the line on one branch, from `s` on; a joint that is free keeps its position in `seed`."""

    s: float
    status: int
    seed: Joints


class Stretches:
    """A line as a row of stretches, each on one branch."""

    def __init__(self, along: LineJoints, status: int) -> None:
        """The line begins on the branch `status`. Raises `LineOutOfReach` and `SingularLine`."""
        self._along = along
        self._inverse = along.inverse
        self._stretches = [_Stretch(0.0, status, along.start)]
        self._free_start = False
        self._free_end = False
        self._s, self._q = self._sampled()
        self.end: Joints = tuple(self._q[-1].tolist())
        """Joint positions (rad) at the end of the line."""

    def path(self) -> Polynomial:
        """The line. Raises `SingularLine`."""
        borders, pieces = self._pieces()
        return Polynomial(borders, pieces, self._along.start, self.end, self._along.line.length_m)

    def _pieces(self) -> tuple[list[float], list[Array]]:
        """Borders (p + 1,) in s, and the coefficients (rows, n) of each piece between two."""
        borders, pieces = [0.0], list[Array]()
        beside: Array | None = None  # the joints and their derivatives (4, n) at the end of what is there
        for low, high, stretch in self._regions():
            inner, fits = self._fitted(low, high, stretch)
            after = at_border(inner[0], inner[1], fits[0], low)
            if low > 0.0:
                before = _on_the_way(after, -low, self._along.start) if beside is None else beside
                pieces.append(self._spliced(borders[-1], low, before, after))
                borders.append(low)
            borders += inner[1:]
            pieces += fits
            beside = at_border(inner[-2], inner[-1], fits[-1], high)
        if self._free_end:
            assert beside is not None
            gap = 1.0 - borders[-1]
            pieces.append(self._spliced(1.0 - gap, 1.0, beside, _on_the_way(beside, gap, self.end)))
            borders.append(1.0)
        return borders, pieces

    def _spliced(self, low: float, high: float, before: Array, after: Array) -> Array:
        """The coefficients (rows, n) of a polynomial over a gap. Raises `SingularLine` where it leaves the
        line."""
        rows = splice(high - low, before, after)
        for part in CHECKED:
            s = low + part * (high - low)
            there = tuple(at_border(low, high, rows, s)[0].tolist())
            if self._off(s, there) > LARGEST_OFF:
                raise SingularLine(s, int(np.abs(after[0] - before[0]).argmax()))
        return rows

    def _off(self, s: float, joints: Joints) -> float:
        """How far the flange is from the line at joint positions (m, or elements of its rotation)."""
        (turned, place), (wanted, there) = self._inverse.model.flange(joints), self._along.line.flange(s)
        return max(_distance(turned, wanted), _distance(place, there))

    def _regions(self) -> list[tuple[float, float, _Stretch]]:
        """The parts between gaps, where the line is fitted: first s, last s, and stretch of each."""
        # A stretch on the branch of the one before it only tells a later seed.
        own = [self._stretches[0]]
        for stretch in self._stretches[1:]:
            if stretch.status != own[-1].status:
                own.append(stretch)
        ends = [stretch.s for stretch in own] + [1.0]
        # A line that changes its branch next to one of its ends is as free there as at the end.
        if len(own) > 1 and ends[1] < GAP:
            self._free_start = True
            del own[0], ends[0]
        if len(own) > 1 and ends[-2] > 1.0 - GAP:
            self._free_end = True
            del own[-1], ends[-1]
        regions = []
        for k, stretch in enumerate(own):
            length = ends[k + 1] - ends[k]
            gap = min(GAP, length / 3.0)
            low, high = ends[k], ends[k + 1]
            if k > 0 or self._free_start:
                low += gap
            if k < len(own) - 1 or self._free_end:
                high -= gap
            regions.append((low, high, stretch))
        return regions

    def _fitted(self, low: float, high: float, stretch: _Stretch) -> tuple[list[float], list[Array]]:
        """Borders in s and coefficients of the pieces of a part between gaps, for which see `_regions`."""
        _, status, seed = stretch
        along = self._along
        near = self._near(low)
        fitted = along.pieces(low, high, status, seed, near, SMALLEST_PIECE, near=True)
        if isinstance(fitted, float):
            last = min(fitted + 2.0 * SMALLEST_PIECE, high)
            s = fitted + 0.5 * (last - fitted) * (1.0 + NODES_AND_WEIGHTS[-1][0])
            along.rows(s, np.full(len(s), status), seed)  # raises where one of these is out of reach
            step = np.abs(np.subtract(self._near(fitted + 2.0 * SMALLEST_PIECE), self._near(fitted)))
            raise SingularLine(fitted, int(step.argmax()))
        return fitted

    def _near(self, s: float) -> Joints:
        """Joint positions at the sample before s; those of the start at 0."""
        return tuple(self._q[int(self._s.searchsorted(s, side="right")) - 1].tolist())

    def _sampled(self) -> tuple[Array, Array]:
        """Places (m,) and joint positions (m, n) there, none of which goes far from one to the next."""
        s = np.linspace(0.0, 1.0, EVEN_SAMPLES)
        q = self._from_start_to_end(s)
        while True:
            steps = np.abs(np.diff(q, axis=0)).max(axis=1)
            split = steps > LARGEST_STEP_RAD
            if not split.any() or steps.sum() < STANDSTILL_RAD:
                return s, q
            place = int(split.argmax())
            if self._cross(float(s[place]), float(s[place + 1]), tuple(q[place].tolist())):
                q = self._from_start_to_end(s)
                continue
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
        q[0] = self._along.start
        q = _without_turns(q)
        inverse, last, start = self._inverse, self._stretches[-1], self._along.start
        self._free_end = len(inverse.merging_statuses(q[-1].tolist(), FREE_AT_END)) > 1
        if self._free_end:
            # A joint that is free at the end keeps the position that it comes with. The inverse cannot tell
            # it, and next to the end the last digits of the target decide on it.
            coming = self._beside(1.0, -BESIDE, last, tuple(q[-2].tolist()))
            # Also next to singular poses the inverse is exact to 1e-10 m and rad, where it follows the seed.
            along = self._along
            flange, redundancy = along.line.flange(1.0), along.redundancy(1.0)
            end = inverse.joints(flange, redundancy, last.status, coming)
            if end is None:
                raise LineOutOfReach(1.0)
            q[-1] = continued(end, coming)
        self._free_start = len(inverse.merging_statuses(start, FREE_AT_START)) > 1
        if self._free_start:
            # A joint that is free at the start must have the position that it leaves with.
            leaving = self._beside(0.0, BESIDE, self._stretches[0], start)
            mismatch = np.abs(np.subtract(leaving, start))
            if mismatch.max() > LARGEST_MISMATCH_RAD:
                raise SingularLine(0.0, int(mismatch.argmax()))
        return q

    def _beside(self, end: float, inwards: float, stretch: _Stretch, near: Joints) -> Joints:
        """Joint positions at an end of the line, by the cubic through four places inwards of it; whole turns
        are those next to `near`."""
        one, two, three, four = (
            np.array(continued(self._reached(end + k * inwards, stretch), near)) for k in (1, 2, 3, 4)
        )
        return tuple((4.0 * one - 6.0 * two + 4.0 * three - four).tolist())

    def _reached(self, s: float, stretch: _Stretch) -> Joints:
        joints = self._along.at(s, stretch.status, stretch.seed)
        if joints is None:
            raise LineOutOfReach(s)
        return joints

    def _positions(self, s: Array) -> Array:
        """Joint positions (m, n) at rising values of s (m,)."""
        starts = np.array([stretch.s for stretch in self._stretches])
        statuses = np.array([stretch.status for stretch in self._stretches])
        places = starts.searchsorted(s, side="right") - 1
        return self._along.rows(s, statuses[places], self._stretches[-1].seed)

    def _cross(self, before: float, after: float, coming: Joints) -> bool:
        """Whether the line goes through a singular pose between two samples; there it changes its branch.

        `coming` are the joints at the sample `before`.
        """
        own = self._stretches[-1]
        if own.s > before or (before == 0.0 and len(self._inverse.merging_statuses(coming)) > 1):
            return False  # just crossed, or the line starts in a singular pose
        for status in self._inverse.statuses:
            if status == own.status:
                continue
            reached = self._along.at(after, status, coming)
            if reached is None:
                continue
            going = continued(reached, coming)
            if _distance(going, coming) > LARGEST_STEP_RAD:
                continue
            low, high = self._along.meeting(own.status, status, own.seed, before, after, coming, going)
            meeting = self._along.at(low, own.status, own.seed, aligned=0.0)
            if meeting is not None and status in self._inverse.merging_statuses(meeting, MEETING):
                self._stretches.append(_Stretch(before, own.status, coming))
                self._stretches.append(_Stretch(high, status, coming))
                return True
        return False


def _on_the_way(beside: Array, way: float, there: Joints) -> Array:
    """Joint positions `there`, with their derivatives (4, n): those of `beside` continued by `way` in s, with
    a constant third derivative."""
    _, first, second, third = beside
    return np.array(
        [there, first + way * (second + 0.5 * way * third), second + way * third, third], dtype=np.float64
    )


def _without_turns(q: Array) -> Array:
    """Joint positions (m, n) along a line, without the whole turns between one and the next."""
    steps = np.diff(q, axis=0)
    if np.abs(steps).max() <= pi:
        return q
    turns = np.zeros_like(q)
    turns[1:] = np.cumsum(np.round(steps / tau), axis=0)
    unturned: Array = q - tau * turns
    return unturned


def _between(s: Array, split: Array) -> Array:
    """New samples in those steps between samples s (m,) that are to be split (m - 1,)."""
    steps = np.diff(s)[split, None]
    between: Array = s[:-1][split, None] + steps * (np.arange(1, PARTS) / PARTS)
    return between.ravel()


def _distance(a: Sequence[float], b: Sequence[float]) -> float:
    return max([abs(x - y) for x, y in zip(a, b, strict=True)])
