"""LIN: joint positions along a straight line of the TCP, as a path of Chebyshev polynomials.

The inverse kinematics gives joint positions at Chebyshev nodes, and polynomials are fitted to them. A line is
halved until each piece is resolved. The redundancy changes evenly from start to target.

A line that comes near a singular pose is sampled until no joint goes far between two samples. A line
on which a joint would jump may pass exactly through the singular pose. It continues on the branch without a
jump.
Rounding dominates the inverse next to such a place, so a polynomial bridges a gap around it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import dist, pi, tau
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform, apply, multiply, rotate, turn_between
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import STANDSTILL_RAD, Array
from iiwa_sim.motion.plan_kernel import Polynomial
from iiwa_sim.robot.arm_kernel import NEAR, OUT_OF_REACH, continued, solve
from iiwa_sim.robot.inverse import Inverse

ALIGNED_RAD = 4e-10  # with less between the axes of two joints, one of them keeps its position along a line
ROUNDING_RAD = 1e-12  # a smaller turn is none
SMALLEST_PIECE = 1.0 / 128.0  # in s; a line that needs smaller ones is sampled first
SMALLEST_NEAR_SINGULAR = 5e-5  # in s; of a line that was sampled
MOST_PIECES = 100
HALVINGS = 40
DEGREE = 32
# Largest of the last three coefficients (rad): of a resolved piece, without and with neighbours. Near
# singular poses rounding shows in all coefficients: they are below ROUNDING and no longer fall by LEVEL.
# Coefficients below NOTHING are left out.
RESOLVED, RESOLVED_ALONE = 1e-12, 1e-11
ROUNDING, LEVEL, NOTHING = 1e-8, 10.0, 1e-13
# Sampling near singular poses.
EVEN_SAMPLES, MOST_SAMPLES = 33, 400
SMALLEST_STEP, PARTS = 1e-4, 4  # in s, and into how many a step is split
LARGEST_STEP_RAD = 0.08  # of a joint from one sample to the next
FREE_AT_START, FREE_AT_END = 1e-5, 2e-8  # rad or m: so near to a singular pose a line starts or ends in it
LARGEST_MISMATCH_RAD = 1e-4  # of a free joint at the start, which the line makes up for
GAP, END_GAP = 0.01, 0.001  # in s, on either side of a singular pose, and beside one at an end
CHECKED, LARGEST_OFF = (0.1, 0.3, 0.5, 0.7, 0.9), 1e-6  # places in a gap; m, or elements of a rotation


class LineOutOfReach(Exception):
    """The arm cannot reach the line, on its branch, from the place `s` on."""

    def __init__(self, s: float) -> None:
        super().__init__(f"at s = {s}")
        self.s = s


class SingularLine(Exception):
    """The line comes so close to a singular pose at `s` that the joint (by index) would have to jump."""

    def __init__(self, s: float, joint: int) -> None:
        super().__init__(f"at s = {s}, joint {joint}")
        self.s = s
        self.joint = joint


class TcpLine:
    """Pose of the flange while the TCP moves straight and turns on the shortest arc; s is the part done.

    Rodrigues: R(s) = R0 + sin(s angle) K R0 + (1 - cos(s angle)) K K R0. The flange lies at -R(s) tool from
    the TCP.
    """

    def __init__(self, start_flange: Transform, target_flange: Transform, tool_in_flange: Transform) -> None:
        """Poses in the base."""
        tool, start = tool_in_flange.translation, start_flange.rotation
        start_tcp, target_tcp = apply(start_flange, tool), apply(target_flange, tool)
        self.length_m = dist(start_tcp, target_tcp)
        """Distance that the TCP goes."""
        (x, y, z), angle = turn_between(start, target_flange.rotation)
        self._angle = angle if angle > ROUNDING_RAD else 0.0
        cross = (0.0, -z, y, z, 0.0, -x, -y, x, 0.0)
        sine = multiply(cross, start)
        versine = multiply(cross, sine)
        shift = [b - a for a, b in zip(start_tcp, target_tcp, strict=True)]
        self._terms = np.array(  # factors of 1, s, sine and 1 - cosine
            [
                (*start, *start_flange.translation),
                (*[0.0] * 9, *shift),
                *((*turned, *[-each for each in rotate(turned, tool)]) for turned in (sine, versine)),
            ]
        )

    def poses(self, s: Array) -> Array:
        """Return poses of the flange in the base (m, 12): rotation row by row, translation (m)."""
        factors = np.ones((len(s), 4))
        factors[:, 1] = s
        if self._angle:
            half = np.sin((0.5 * self._angle) * s)
            factors[:, 2], factors[:, 3] = np.sin(self._angle * s), 2.0 * half * half
        else:
            factors[:, 2:] = 0.0
        found: Array = np.einsum("ij,jk->ik", factors, self._terms)
        return found

    def flange(self, s: float) -> Transform:
        """Pose of the flange in the base."""
        numbers = tuple(self.poses(np.array([s]))[0].tolist())
        return Transform(numbers[:9], numbers[9:])


def lin(inverse: Inverse, start: Joints, line: TcpLine, target_redundancy: float, status: int) -> Polynomial:
    """Return the path of a line that begins at joint positions (rad) on the branch `status`.

    Raises:
        LineOutOfReach: A part of the line is out of reach on its branch.
        SingularLine: A joint would have to jump near a singular pose.
    """
    along = _LineJoints(inverse, start, line, target_redundancy)
    if len(inverse.merging_statuses(start, FREE_AT_START)) == 1:
        fitted = along.pieces(0.0, 1.0, status, start, start, SMALLEST_PIECE, near=False)
        if not isinstance(fitted, float):
            borders, pieces = fitted
            return Polynomial(borders, pieces, start, tuple(pieces[-1].sum(axis=0).tolist()), line.length_m)
    return _SampledLine(along, status).path()


class _LineJoints:
    """Inverse kinematics along one line. Joints are rad, (n,) or (m, n)."""

    def __init__(self, inverse: Inverse, start: Joints, line: TcpLine, target_redundancy: float) -> None:
        self.inverse, self.start, self.line = inverse, start, line
        self._redundancy = inverse.redundancy(start)
        self._change = target_redundancy - self._redundancy

    def redundancy(self, s: float) -> float:
        return self._redundancy + s * self._change

    def _solve(
        self, s: Array, statuses: NDArray[np.int64], seed: Sequence[float]
    ) -> tuple[Array, NDArray[np.int64]]:
        """Return joint positions (m, n) at places (m,), on a branch each, and results of `solve` (m,).

        If the axes of two joints are parallel, one of them keeps its position in the seed.
        """
        joints, results = np.empty((len(s), len(self.start))), np.empty(len(s), dtype=np.int64)
        inverse, redundancies = self.inverse, self._redundancy + s * self._change
        poses, following = self.line.poses(s), np.array(seed, dtype=np.float64)
        kind, numbers = inverse.kind, inverse.numbers
        solve(kind, numbers, poses, redundancies, statuses, following, ALIGNED_RAD, joints, results)
        return joints, results

    def at(self, s: float, status: int, seed: Sequence[float]) -> Joints | None:
        """Return joint positions at s on a branch; None where that does not reach."""
        joints, results = self._solve(np.array([s]), np.array([status]), seed)
        return None if results[0] == OUT_OF_REACH else tuple(joints[0].tolist())

    def rows(self, s: Array, statuses: NDArray[np.int64], seed: Joints) -> Array:
        """Return joint positions (m, n) at rising places (m,), on a branch each. Raises `LineOutOfReach`."""
        joints, results = self._solve(s, statuses, seed)
        beyond = results == OUT_OF_REACH
        if beyond.any():
            row = int(beyond.argmax())
            near, far, status = float(s[max(row - 1, 0)]) if row else 0.0, float(s[row]), int(statuses[row])
            for _ in range(HALVINGS):
                middle = 0.5 * (near + far)
                if self.at(middle, status, seed) is None:
                    far = middle
                else:
                    near = middle
            raise LineOutOfReach(far)
        return joints

    def pieces(
        self,
        low: float,
        high: float,
        status: int,
        seed: Joints,
        reference: Sequence[float],
        smallest: float,
        *,
        near: bool,
    ) -> tuple[list[float], list[Array]] | float:
        """Return borders (p + 1,) and coefficients of the pieces from s = low to high.

        The first piece begins next to the reference (rad). Return the s of the piece that would be smaller
        than `smallest`, or one too many. Singular poses end a piece unless `near`.
        """
        borders, pieces, ends = [low], list[Array](), [high]
        while ends:
            high = ends.pop()
            found = self._fitted(low, high, status, seed, reference, near=near)
            if found is not None:
                borders.append(high)
                pieces.append(found)
                low, reference = high, found.sum(axis=0).tolist()
            elif high - low < 2.0 * smallest or len(pieces) + len(ends) >= MOST_PIECES:
                return low
            else:
                ends += [high, 0.5 * (low + high)]
        return borders, pieces

    def _fitted(
        self, low: float, high: float, status: int, seed: Joints, reference: Sequence[float], *, near: bool
    ) -> Array | None:
        """Return coefficients (rows, n) of a polynomial for low <= s <= high; None where there is none."""
        s = low + 0.5 * (high - low) * (1.0 + NODES)
        s[-1] = high
        joints, results = self._solve(s, np.full(len(s), status), seed)
        worst = results.max()
        if worst == OUT_OF_REACH or (worst == NEAR and not near):
            return None
        joints = _without_turns(np.concatenate([[reference], joints]))[1:]
        if low == 0.0:
            joints[0] = reference
        return _fit(joints, low == 0.0 and high == 1.0)


def _fit(joints: Array, alone: bool) -> Array | None:
    """Return coefficients (rows, n) of a polynomial through joints at `NODES`; None if these are too few.

    Its ends are met but for rounding. `alone` says that the piece has no neighbours.
    """
    coefficients: Array = WEIGHTS @ joints
    sizes = np.abs(coefficients).max(axis=1).tolist()
    rows = len(sizes)
    tail, level, nothing = max(sizes[-3:]), max(sizes[rows - (rows - 1) // 2 : -3]), NOTHING
    if tail > (RESOLVED_ALONE if alone else RESOLVED):
        if tail > ROUNDING or level > LEVEL * tail:
            return None
        nothing = 4.0 * tail
    while rows > 2 and sizes[rows - 1] <= nothing:
        rows -= 1
    coefficients = coefficients[:rows]
    first = joints[0] - (coefficients[::2].sum(axis=0) - coefficients[1::2].sum(axis=0))
    end = joints[-1] - coefficients.sum(axis=0)
    coefficients[0] += 0.5 * (first + end)
    coefficients[1] += 0.5 * (end - first)
    return coefficients


def _nodes_and_weights(degree: int) -> tuple[Array, Array]:
    """Return nodes (degree + 1,) in -1..1, and factors of the values there in each coefficient."""
    k = np.arange(degree + 1)
    nodes = np.sin(pi * (2 * k - degree) / (2 * degree))
    nodes[0], nodes[-1] = -1.0, 1.0
    weights = 2.0 / degree * np.cos(pi * (np.outer(k, degree - k) % (2 * degree)) / degree)
    weights[:, [0, -1]] *= 0.5
    weights[[0, -1]] *= 0.5
    return nodes, weights


NODES, WEIGHTS = _nodes_and_weights(DEGREE)


class _Section(NamedTuple):
    """A part of the line on one branch, from `s` on; a joint that is free keeps its position in `seed`."""

    s: float
    status: int
    seed: Joints


class _SampledLine:
    """A line near singular poses, as sections on one branch each."""

    def __init__(self, along: _LineJoints, status: int) -> None:
        """The line begins on the branch `status`. Raises `LineOutOfReach` and `SingularLine`."""
        self._along = along
        self._inverse = along.inverse
        self._sections = [_Section(0.0, status, along.start)]
        self._free_start = len(self._inverse.merging_statuses(along.start, FREE_AT_START)) > 1
        self._s, self._q = self._sampled()

    def path(self) -> Polynomial:
        """Return the path. Raises `SingularLine`."""
        borders, pieces, start = [0.0], list[Array](), self._along.start
        beside: Array | None = None  # joints and derivatives (4, n) at the end of the previous pieces
        for low, high, section in self._regions():
            inner, fits = self._fitted(low, high, section)
            after = at_border(inner[0], inner[1], fits[0], low)
            if low > 0.0:
                if beside is None:
                    # A joint that is free at the start must have the position that it leaves with.
                    beside = at_border(inner[0], inner[1], fits[0], 0.0)
                    mismatch = np.abs(beside[0] - start)
                    if mismatch.max() > LARGEST_MISMATCH_RAD:
                        raise SingularLine(0.0, int(mismatch.argmax()))
                    beside[0] = start
                pieces.append(self._spliced(borders[-1], low, beside, after))
                borders.append(low)
            borders += inner[1:]
            pieces += fits
            beside = at_border(inner[-2], inner[-1], fits[-1], high)
        end: Joints = tuple(self._q[-1].tolist())
        if self._free_end:
            assert beside is not None
            after = at_border(borders[-2], borders[-1], pieces[-1], 1.0)
            after[0] = end = self._end(after[0])
            pieces.append(self._spliced(borders[-1], 1.0, beside, after))
            borders.append(1.0)
        return Polynomial(borders, pieces, start, end, self._along.line.length_m)

    def _spliced(self, low: float, high: float, before: Array, after: Array) -> Array:
        """Return coefficients (rows, n) of a polynomial over a gap. Raises `SingularLine` off the line."""
        rows = splice(high - low, before, after)
        for part in CHECKED:
            s = low + part * (high - low)
            reached = self._inverse.model.flange(at_border(low, high, rows, s)[0].tolist())
            wanted = self._along.line.flange(s)
            off = max(_distance(*pair) for pair in zip(reached, wanted, strict=True))
            if off > LARGEST_OFF:
                raise SingularLine(s, int(np.abs(after[0] - before[0]).argmax()))
        return rows

    def _regions(self) -> list[tuple[float, float, _Section]]:
        """First s, last s and section of each part between gaps."""
        own, ends = list(self._sections), [*(section.s for section in self._sections), 1.0]
        # A line that changes its branch next to one of its ends is as free there as at the end.
        if len(own) > 1 and ends[1] < END_GAP:
            self._free_start = True
            del own[0], ends[0]
        if len(own) > 1 and ends[-2] > 1.0 - END_GAP:
            self._free_end = True
            del own[-1], ends[-1]
        regions = []
        for k, section in enumerate(own):
            gap = min(GAP, (ends[k + 1] - ends[k]) / 3.0)
            low = ends[k] + (gap if k > 0 else END_GAP * self._free_start)
            high = ends[k + 1] - (gap if k < len(own) - 1 else END_GAP * self._free_end)
            regions.append((low, high, section))
        return regions

    def _fitted(self, low: float, high: float, section: _Section) -> tuple[list[float], list[Array]]:
        """Return borders in s and coefficients of the pieces of a part between gaps."""
        _, status, seed = section
        fitted = self._along.pieces(
            low, high, status, seed, self._near(low), SMALLEST_NEAR_SINGULAR, near=True
        )
        if isinstance(fitted, float):
            step = np.subtract(self._near(fitted + 2.0 * SMALLEST_NEAR_SINGULAR), self._near(fitted))
            raise SingularLine(fitted, int(np.abs(step).argmax()))
        return fitted

    def _near(self, s: float) -> Joints:
        """Return joint positions at the sample before s; those of the start at 0."""
        return tuple(self._q[int(self._s.searchsorted(s, side="right")) - 1].tolist())

    def _sampled(self) -> tuple[Array, Array]:
        """Return places (m,) and joint positions (m, n) that do not go far from one place to the next."""
        s = np.linspace(0.0, 1.0, EVEN_SAMPLES)
        q = self._from_start_to_end(s)
        while True:
            steps = np.abs(np.diff(q, axis=0)).max(axis=1)
            split = steps > LARGEST_STEP_RAD
            if not split.any() or steps.sum() < STANDSTILL_RAD:
                return s, q
            tiny = split & (np.diff(s) < SMALLEST_STEP)
            if tiny.any() or len(s) > MOST_SAMPLES:
                place = int((tiny if tiny.any() else split).argmax())
                self._cross(float(s[place]), float(s[place + 1]), q[place], q[place + 1])
                q = self._from_start_to_end(s)
                continue
            parts = np.diff(s)[split, None] * (np.arange(1, PARTS) / PARTS)
            between = (s[:-1][split, None] + parts).ravel()
            s, q = np.concatenate([s, between]), np.concatenate([q, self._positions(between)])
            order = s.argsort()
            s, q = s[order], _without_turns(q[order])

    def _from_start_to_end(self, s: Array) -> Array:
        """Return joint positions (m, n) at rising values of s (m,), 0 and 1 included."""
        q = self._positions(s)
        q[0] = self._along.start
        q = _without_turns(q)
        self._free_end = len(self._inverse.merging_statuses(q[-1].tolist(), FREE_AT_END)) > 1
        if self._free_end:
            q[-1] = self._end(q[-2])
        return q

    def _end(self, coming: Array) -> Joints:
        """Return joint positions at the end; a joint that is free there keeps its position."""
        along, near = self._along, tuple(coming.tolist())
        pose, redundancy = along.line.flange(1.0), along.redundancy(1.0)
        end = self._inverse.joints(pose, redundancy, self._sections[-1].status, near)
        if end is None:
            raise LineOutOfReach(1.0)
        return continued(end, near)

    def _positions(self, s: Array) -> Array:
        """Return joint positions (m, n) at rising values of s (m,)."""
        starts = np.array([section.s for section in self._sections])
        statuses = np.array([section.status for section in self._sections])
        places = starts.searchsorted(s, side="right") - 1
        return self._along.rows(s, statuses[places], self._sections[-1].seed)

    def _cross(self, before: float, after: float, coming: Array, jumped: Array) -> None:
        """Change the branch between two samples, where the line passes a singular pose.

        Raises `SingularLine` where no other branch continues from the joints `coming`.
        """
        for status in self._inverse.statuses:
            reached = self._along.at(after, status, coming.tolist())
            if reached is not None and before > self._sections[-1].s:
                going = continued(reached, tuple(coming.tolist()))
                if _distance(going, coming.tolist()) <= LARGEST_STEP_RAD:
                    self._sections.append(_Section(after, status, tuple(coming.tolist())))
                    return
        raise SingularLine(before, int(np.abs(jumped - coming).argmax()))


_ORDERS = np.arange(8.0)
_AT_1 = np.cumprod([_ORDERS**0, _ORDERS**2, (_ORDERS**2 - 1.0) / 3.0, (_ORDERS**2 - 4.0) / 5.0], axis=0)
_AT_ENDS = np.concatenate([_AT_1 * (-1.0) ** np.add.outer(np.arange(4), _ORDERS), _AT_1])
"""Values and three derivatives (8, 8) of the first Chebyshev polynomials at -1 and at 1."""


def splice(width: float, first: Array, last: Array) -> Array:
    """Return coefficients (8, n) of the polynomial with these values and derivatives (4, n) at its ends.

    `width` is its width in s; derivatives are over s.
    """
    scales = (0.5 * width) ** np.arange(4.0)[:, None]
    rows: Array = np.linalg.solve(_AT_ENDS, np.concatenate([first * scales, last * scales]))
    return rows


def at_border(low: float, high: float, coefficients: Array, s: float) -> Array:
    """Return joint positions and three derivatives (4, n), at any s, of a piece from s = low to high."""
    return Polynomial((low, high), [coefficients], (), ()).derivatives(np.array([s]))[:, 0]


def _without_turns(q: Array) -> Array:
    """Return joint positions (m, n) along a line, without whole turns between one and the next."""
    steps = np.diff(q, axis=0)
    if np.abs(steps).max() <= pi:
        return q
    turns = np.zeros_like(q)
    turns[1:] = np.cumsum(np.round(steps / tau), axis=0)
    unturned: Array = q - tau * turns
    return unturned


def _distance(a: Sequence[float], b: Sequence[float]) -> float:
    return max([abs(x - y) for x, y in zip(a, b, strict=True)])
