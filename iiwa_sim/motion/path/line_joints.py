"""The joints along a line of the TCP by the closed-form inverse, and polynomials fitted to them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.path import line_kernel
from iiwa_sim.motion.tcp_line import TcpLine
from iiwa_sim.robot.inverse_kernel import OUT_OF_REACH, Inverse

DEGREES = (16, 32)
"""Degrees of the polynomials that are tried; the nodes of the first are among those of the second."""
ALIGNED_RAD = 4e-10
"""With less than this between the axes of two joints, one of them keeps its position along a line."""
_HALVINGS = 40
_MOST_PIECES = 100


def _nodes_and_weights(degree: int) -> tuple[Array, Array]:
    nodes, weights = np.empty(degree + 1), np.empty((degree + 1, degree + 1))
    line_kernel.nodes_and_weights(degree, nodes, weights)
    return nodes, weights


_NODES_AND_WEIGHTS = tuple(map(_nodes_and_weights, DEGREES))


class LineOutOfReach(Exception):
    """The arm cannot reach the line, on its branch, from the place `s` on."""

    def __init__(self, s: float) -> None:
        super().__init__(f"at s = {s}")
        self.s = s


class SingularLine(Exception):
    """At `s` the line comes so close to a singular pose that the joint (by index) would have to jump."""

    def __init__(self, s: float, joint: int) -> None:
        super().__init__(f"at s = {s}, joint {joint}")
        self.s = s
        self.joint = joint


class LineJoints:
    """The inverse along one line, the redundancy going evenly with s. Joints are rad, (n,) or (m, n)."""

    def __init__(self, inverse: Inverse, start: Joints, line: TcpLine, target_redundancy: float) -> None:
        """`start` are the joint positions at the beginning of the line."""
        self.inverse = inverse
        self.line = line
        self.start = start
        self._redundancy = inverse.redundancy(start)
        self._way = target_redundancy - self._redundancy
        self._one, self._one_status = np.empty(1), np.empty(1, dtype=np.int64)
        self._one_room = np.empty((1, 12)), np.empty((1, len(start)))
        self._one_result = np.empty(1, dtype=np.int8)
        # Of each degree: poses, joints, coefficients.
        self._rooms = [
            (np.empty((degree + 1, 12)), *np.empty((2, degree + 1, len(start)))) for degree in DEGREES
        ]
        self._arm = (inverse.kind, inverse.numbers, line.numbers, self._redundancy, self._way)

    def at(self, s: float, status: int, seed: Joints, aligned: float = ALIGNED_RAD) -> Joints | None:
        """Joint positions at s on a branch; None where that does not reach.

        Where the axes of two joints are parallel to `aligned` (rad), one of them is free, and keeps its
        position in the seed. Next to such places rounding shows.
        """
        self._one[0], self._one_status[0] = s, status
        line_kernel.places(
            *self._arm,
            self._one_status,
            np.array(seed),
            aligned,
            self._one,
            *self._one_room,
            self._one_result,
        )
        return None if self._one_result[0] == OUT_OF_REACH else tuple(self._one_room[1][0].tolist())

    def rows(self, s: Array, statuses: NDArray[np.int64], seed: Joints) -> Array:
        """Joint positions (m, n) at rising places (m,), on a branch each. Raises `LineOutOfReach`."""
        joints, results = self._places(s, statuses, seed, ALIGNED_RAD)
        unreached = results == OUT_OF_REACH
        if unreached.any():
            place = int(unreached.argmax())
            far = float(s[place])
            near = 0.0 if place == 0 else float(s[place - 1])
            raise LineOutOfReach(self._end_of_reach(near, far, int(statuses[place]), seed))
        return joints

    def closed(self, s: float, status: int, seed: Joints) -> Joints | None:
        """Joint positions at s on a branch, exact to 1e-10 m and rad also next to singular poses, where they
        follow the seed; None out of reach."""
        redundancy = self._redundancy + s * self._way
        return self.inverse.joints(self.line.flange(s), redundancy, status, seed)

    def fitted(
        self, low: float, high: float, status: int, seed: Joints, reference: Joints, *, near: bool
    ) -> Array | None:
        """Coefficients (rows, n) of a polynomial for low <= s <= high, in the turns next to the reference.

        None where that takes more than the highest of the degrees, where a place is out of reach, or, unless
        `near`, singular.
        """
        seeds, references = np.array(seed), np.array(reference)
        for (nodes, weights), room in zip(_NODES_AND_WEIGHTS, self._rooms, strict=True):
            rows = line_kernel.fit(
                *self._arm, status, seeds, ALIGNED_RAD, near, low, high, references, nodes, weights, *room
            )
            if rows > 0:
                coefficients: Array = room[2][:rows].copy()
                return coefficients
            if rows != line_kernel.NOT_RESOLVED:
                return None
        return None

    def off(self, s: float, joints: Joints) -> float:
        """How far the flange is from the line at joint positions (m, or elements of its rotation)."""
        reached, wanted = self.inverse.model.flange(joints), self.line.flange(s)
        return max(
            [abs(a - b) for a, b in zip((*reached[0], *reached[1]), (*wanted[0], *wanted[1]), strict=True)]
        )

    def meeting(
        self,
        own: int,
        other: int,
        seed: Joints,
        before: float,
        after: float,
        coming: Joints,
        going: Joints,
    ) -> tuple[float, float]:
        """The last s on the own branch and the first on the other one, where they meet between two places.

        `coming` and `going` are the joints at these.
        """
        found: tuple[float, float] = line_kernel.meeting(
            *self._arm, own, other, np.array(seed), before, after, np.array(coming), np.array(going),
            *self._one_room,
        )  # fmt: skip
        return found

    def check_reach(self, low: float, high: float, status: int, seed: Joints) -> None:
        """Raises `LineOutOfReach` where the branch does not reach a node of the piece."""
        s = low + 0.5 * (high - low) * (1.0 + _NODES_AND_WEIGHTS[-1][0])
        self.rows(s, np.full(len(s), status), seed)

    def _places(
        self, s: Array, statuses: NDArray[np.int64], seed: Sequence[float], aligned: float
    ) -> tuple[Array, NDArray[np.int8]]:
        poses, joints = np.empty((len(s), 12)), np.empty((len(s), len(self.start)))
        results = np.empty(len(s), dtype=np.int8)
        line_kernel.places(*self._arm, statuses, np.array(seed), aligned, s, poses, joints, results)
        return joints, results

    def _end_of_reach(self, near: float, far: float, status: int, seed: Joints) -> float:
        """The s, between a place that is reached and one that is not, from which on the line is out of
        reach."""
        for _ in range(_HALVINGS):
            middle = 0.5 * (near + far)
            if self.at(middle, status, seed) is None:
                far = middle
            else:
                near = middle
        return far


def fitted_pieces(
    along: LineJoints,
    low: float,
    high: float,
    status: int,
    seed: Joints,
    reference: Joints,
    smallest: float,
    *,
    near: bool,
) -> tuple[list[float], list[Array]] | float:
    """Borders (p + 1,) and pieces of a line from s = low to high: halved until each is resolved.

    The first one begins next to the reference. Where a piece would be smaller than `smallest`, or
    there would be too many, the s where that one begins is returned; for `near` see `LineJoints.fitted`.
    """
    borders, pieces, waiting = [low], list[Array](), [high]
    while waiting:
        low, high = borders[-1], waiting[-1]
        found = along.fitted(low, high, status, seed, reference, near=near)
        if found is not None:
            borders.append(waiting.pop())
            pieces.append(found)
            reference = tuple(found.sum(axis=0).tolist())
        elif high - low < 2.0 * smallest or len(pieces) + len(waiting) > _MOST_PIECES:
            return low
        else:
            waiting.append(0.5 * (low + high))
    return borders, pieces
