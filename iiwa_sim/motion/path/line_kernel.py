"""LIN: the joints along a line of the TCP by the closed-form inverse, and polynomials fitted to them.

The redundancy goes evenly from start to target. What is not regular as a whole is looked at in
`iiwa_sim.motion.path.singular`.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cython
import numpy as np
from numpy.typing import NDArray

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.path.fit_kernel import NODES_AND_WEIGHTS
from iiwa_sim.motion.path.piecewise_kernel import Polynomial
from iiwa_sim.motion.path.tcp_line_kernel import TcpLine
from iiwa_sim.robot.inverse import Inverse

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.path.fit_kernel import fit
    from cython.cimports.iiwa_sim.robot.arm_kernel import solve
else:
    from iiwa_sim.motion.path.fit_kernel import fit
    from iiwa_sim.robot.arm_kernel import solve

FREE_AT_START = 1e-5
"""So near to a singular pose (rad or m) a line is taken to start in it."""
SMALLEST_PIECE = 1.0 / 128.0
"""In s: a line that needs smaller ones is looked at more closely before."""
ALIGNED_RAD = 4e-10
"""With less than this between the axes of two joints, one of them keeps its position along a line."""
_ALIGNED = cython.declare(cython.double, 4e-10)
_MOST_NODES = 33
_HALVINGS = cython.declare(cython.int, 40)  # of a step, to find where the arm does not reach
_MEETING_HALVINGS = cython.declare(cython.int, 50)  # or where branches meet
_MOST_PIECES = 100

_NEAR = cython.declare(cython.int, 1)
_OUT_OF_REACH = cython.declare(cython.int, 2)
_PI = cython.declare(cython.double, 3.141592653589793)
_TAU = cython.declare(cython.double, 6.283185307179586)


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


@cython.cclass
class LineJoints:
    """The inverse along one line, the redundancy going evenly with s. Joints are rad, (n,) or (m, n)."""

    def __init__(self, inverse: Inverse, start: Joints, line: TcpLine, target_redundancy: float) -> None:
        """`start` are the joint positions at the beginning of the line."""
        self.inverse = inverse
        self.line = self._line = line
        self.start = start
        self._redundancy = inverse.redundancy(start)
        self._way = target_redundancy - self._redundancy
        self._count = len(start)
        self._kind, self._numbers = inverse.kind, inverse.numbers
        self._poses, self._joints = np.empty((_MOST_NODES, 12)), np.empty((_MOST_NODES, self._count))
        self._seed, self._reference = np.empty(self._count), np.empty(self._count)

    @cython.cfunc
    @cython.exceptval(check=False)
    def _place(
        self, row: cython.Py_ssize_t, s: cython.double, status: cython.int, aligned: cython.double
    ) -> cython.int:
        """The joint positions at s on a branch into a row, following the seed; says what the inverse does."""
        self._line.pose(s, self._poses, row)
        redundancy = self._redundancy + s * self._way
        return solve(
            self._kind, self._numbers, self._poses, row, redundancy, status, self._seed, aligned, self._joints
        )

    @cython.cfunc
    def _follow(self, seed: Any) -> Any:
        for k in range(self._count):
            self._seed[k] = seed[k]

    def path(self, status: int) -> Polynomial | None:
        """The line, which begins on the branch `status` and stays on it.

        None where it is to be looked at more closely: where it begins, or comes, near a singular pose, is out
        of reach, or needs pieces smaller than `SMALLEST_PIECE`.
        """
        if len(self.inverse.merging_statuses(self.start, FREE_AT_START)) > 1:
            return None
        fitted = self.pieces(0.0, 1.0, status, self.start, self.start, SMALLEST_PIECE, near=False)
        if isinstance(fitted, float):
            return None
        borders, pieces = fitted
        end = tuple(pieces[len(pieces) - 1].sum(axis=0).tolist())
        return Polynomial(borders, pieces, self.start, end, self.line.length_m)

    def redundancy(self, s: float) -> float:
        """The redundancy (rad) at s."""
        return self._redundancy + s * self._way

    def at(
        self, s: cython.double, status: cython.int, seed: Joints, aligned: cython.double = ALIGNED_RAD
    ) -> Joints | None:
        """Joint positions at s on a branch; None where that does not reach.

        Where the axes of two joints are parallel to `aligned` (rad), one of them is free, and keeps its
        position in the seed. Next to such places rounding shows.
        """
        self._follow(seed)
        if self._place(0, s, status, aligned) == _OUT_OF_REACH:
            return None
        return tuple([self._joints[0, k] for k in range(self._count)])

    def rows(self, s: Array, statuses: NDArray[np.int64], seed: Joints) -> Array:
        """Joint positions (m, n) at rising places (m,), on a branch each. Raises `LineOutOfReach`."""
        joints: Array = np.empty((len(s), self._count))
        found: cython.double[:, ::1] = joints
        place: cython.double[::1] = s
        status: cython.longlong[::1] = statuses
        self._follow(seed)
        row: cython.Py_ssize_t
        for row in range(place.shape[0]):
            if self._place(0, place[row], status[row], _ALIGNED) == _OUT_OF_REACH:
                near = 0.0 if row == 0 else place[row - 1]
                raise LineOutOfReach(self._end_of_reach(near, place[row], status[row]))
            for k in range(self._count):
                found[row, k] = self._joints[0, k]
        return joints

    @cython.cfunc
    @cython.exceptval(check=False)
    def _end_of_reach(self, near: cython.double, far: cython.double, status: cython.int) -> cython.double:
        """The s, between a place that is reached and one that is not, from which on the line is out of
        reach."""
        k: cython.int = 0
        while k < _HALVINGS:
            k += 1
            middle = 0.5 * (near + far)
            if self._place(0, middle, status, _ALIGNED) == _OUT_OF_REACH:
                far = middle
            else:
                near = middle
        return far

    def meeting(
        self,
        own: int,
        other: int,
        seed: Joints,
        before: cython.double,
        after: cython.double,
        coming: Joints,
        going: Joints,
    ) -> tuple[float, float]:
        """The last s on the own branch, which follows the seed, and the first on the other one, where they
        meet between two places; `coming` and `going` are the joints at these.

        The own one is nearer to an even way of the joints from coming to going up to there, the other one
        from there on. A branch that does not reach a place is far.
        """
        low: cython.double = before
        high: cython.double = after
        one: cython.double
        another: cython.double
        step: cython.int = 0
        while step < _MEETING_HALVINGS:
            step += 1
            s = 0.5 * (low + high)
            part = (s - before) / (after - before)
            one = another = 1e9
            self._follow(seed)
            if self._place(0, s, own, 0.0) != _OUT_OF_REACH:
                one = self._off_even_way(coming, going, part)
            self._follow(coming)
            if self._place(0, s, other, 0.0) != _OUT_OF_REACH:
                another = self._off_even_way(coming, going, part)
            if one <= another:
                low = s
            else:
                high = s
        return low, high

    @cython.cfunc
    @cython.exceptval(-1.0)
    def _off_even_way(self, coming: Any, going: Any, part: cython.double) -> cython.double:
        """How far a joint is from the part of the way from coming to going (rad), but for whole turns."""
        farthest: cython.double = 0.0
        first: cython.double
        last: cython.double
        for j in range(self._count):
            first, last = coming[j], going[j]
            off: cython.double = self._joints[0, j] - first - part * (last - first)
            while off > _PI:
                off -= _TAU
            while off < -_PI:
                off += _TAU
            farthest = max(farthest, off, -off)
        return farthest

    def fitted(
        self, low: float, high: float, status: int, seed: Joints, reference: Sequence[float], *, near: bool
    ) -> Array | None:
        """Coefficients (rows, n) of a polynomial for low <= s <= high, in the turns next to the reference.

        None where that takes more than the highest of the degrees, where a place is out of reach, or, unless
        `near`, singular.
        """
        self._follow(seed)
        for k in range(self._count):
            self._reference[k] = reference[k]
        for nodes, weights in NODES_AND_WEIGHTS:
            coefficients: Array = np.empty((len(nodes), self._count))
            rows: cython.Py_ssize_t = self._fit(low, high, status, near, nodes, weights, coefficients)
            if rows > 0:
                return coefficients[:rows]
            if rows < 0:
                return None
        return None

    @cython.cfunc
    @cython.exceptval(-2)
    def _fit(
        self,
        low: cython.double,
        high: cython.double,
        status: cython.int,
        near: cython.bint,
        nodes: cython.double[::1],
        weights: cython.double[:, ::1],
        coefficients: cython.double[:, ::1],
    ) -> cython.Py_ssize_t:
        """As `fit` says; -1 also where a place is out of reach, or singular and not to be `near` that."""
        joints = self._joints
        last: cython.Py_ssize_t = nodes.shape[0] - 1
        before: cython.double
        for k in range(last + 1):
            s = high if k == last else low + 0.5 * (high - low) * (1.0 + nodes[k])
            result = self._place(k, s, status, _ALIGNED)
            if result == _OUT_OF_REACH or (result == _NEAR and not near):
                return -1
            # Each joint goes on from where it was, the first from the reference, in whatever turn.
            for j in range(self._count):
                before = joints[k - 1, j] if k > 0 else self._reference[j]
                while joints[k, j] - before > _PI:
                    joints[k, j] -= _TAU
                while joints[k, j] - before < -_PI:
                    joints[k, j] += _TAU
        if low == 0.0:
            for j in range(self._count):
                joints[0, j] = self._reference[j]
        return fit(joints, weights, low == 0.0 and high == 1.0, coefficients)

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
        """Borders (p + 1,) and pieces of the line from s = low to high: halved until each is resolved.

        The first one begins next to the reference. Where a piece would be smaller than `smallest`, or
        there would be too many, the s where that one begins is returned; for `near` see `fitted`.
        """
        borders, pieces, waiting = [low], list[Array](), [high]
        while waiting:
            high = waiting.pop()
            found = self.fitted(low, high, status, seed, reference, near=near)
            if found is not None:
                borders.append(high)
                pieces.append(found)
                low, reference = high, found.sum(axis=0).tolist()
            elif high - low < 2.0 * smallest or len(pieces) + len(waiting) >= _MOST_PIECES:
                return low
            else:
                waiting += [high, 0.5 * (low + high)]
        return borders, pieces
