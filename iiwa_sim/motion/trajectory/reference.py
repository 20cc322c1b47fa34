"""The reference of a joint trajectory: where joints shall be at which time, told by points.

Between two points the curve is the one of ros2_controllers' joint_trajectory_controller: a quintic where both
have velocities and accelerations, a cubic where both have velocities, else a straight line.
"""

from collections.abc import Sequence
from math import comb
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.path import Outside, first_outside
from iiwa_sim.motion.plan_kernel import Polynomial

ROWS = 6
"""Rows of coefficients of a piece, which is a quintic at most."""


class Knot(NamedTuple):
    """A point of a trajectory, its joints in the order of the robot's."""

    time_s: float
    """Since the trajectory has begun; a first knot may lie before that."""
    positions: Joints
    """rad"""
    velocities: Joints | None = None
    """rad/s"""
    accelerations: Joints | None = None
    """rad/s^2"""


class Range(NamedTuple):
    """Bounds of a derivative over the whole reference, those of the standstill before and behind it
    included."""

    lowest: Array
    """(n,)"""
    highest: Array
    """(n,)"""

    @property
    def width(self) -> Array:
        """(n,)"""
        return self.highest - self.lowest

    @property
    def magnitude(self) -> Array:
        """(n,)"""
        return np.maximum(self.highest, -self.lowest)


class Reference:
    """Joint positions (rad) over time (s); before its first knot, and behind its last one, it stands
    still."""

    def __init__(self, knots: Sequence[Knot]) -> None:
        """A curve through two knots at least, whose times rise; the last of them lies behind 0."""
        self.times = np.array([knot.time_s for knot in knots])
        """(pieces + 1,)"""
        self.start = knots[0].positions
        self.end = knots[-1].positions
        self._pieces = _chebyshev(self.times, knots)  # (pieces, ROWS, joints)
        self.curve = Polynomial(self.times, list(self._pieces), self.start, self.end)
        """Curve from the first knot to the last, over time."""
        self.end_s = knots[-1].time_s

    def at(self, time_s: float) -> tuple[Joints, Joints, Joints]:
        """Positions (rad), velocities (rad/s) and accelerations (rad/s^2) at a time."""
        still = (0.0,) * len(self.start)
        if time_s >= self.end_s:
            return self.end, still, still
        if time_s < self.times[0]:
            return self.start, still, still
        values = self.curve.derivatives(np.array([time_s]))[:3, 0].tolist()
        position, velocity, acceleration = map(tuple, values)
        return position, velocity, acceleration

    def first_beyond(self, order: int, lowest: Array, highest: Array) -> Outside | None:
        """Where positions (order 0), velocities (1) or accelerations (2) first leave bounds (n,); None if
        nowhere. Its s is the time (s).

        All of the curve is looked at, not samples of it.
        """
        pieces = list(self._derivative(order))
        found = first_outside(Polynomial(self.times, pieces, self.start, self.end), lowest, highest)
        return found and found._replace(s=max(found.s, 0.0))

    def range(self, order: int) -> Range:
        """Bounds of velocities (order 1), accelerations (2) or jerks (3), which for curves are a little
        wide."""
        pieces = self._derivative(order)
        middle, reach = pieces[:, 0], np.abs(pieces[:, 1:]).sum(axis=1)
        return Range(
            np.minimum((middle - reach).min(axis=0), 0.0), np.maximum((middle + reach).max(axis=0), 0.0)
        )

    def largest_jump(self, order: int, *, from_rest: bool = True) -> Array:
        """How far velocities (order 1) or accelerations (2) jump at most where pieces meet and at the ends
        (n,).

        That at the start counts where the joints come `from_rest`.
        """
        pieces = self._derivative(order)
        signs = np.where(np.arange(pieces.shape[1]) % 2, -1.0, 1.0)
        still = np.zeros((1, len(self.start)))
        before = np.concatenate([still, pieces.sum(axis=1)])
        after = np.concatenate([(pieces * signs[:, None]).sum(axis=1), still])
        jumps = np.abs(after - before)
        largest: Array = jumps[0 if from_rest else 1 :].max(axis=0)
        return largest

    def _derivative(self, order: int) -> Array:
        """Chebyshev coefficients (pieces, ROWS - order, n) of a derivative by time."""
        pieces = self._pieces
        scale = (2.0 / np.diff(self.times))[:, None, None]
        for rows in range(ROWS, ROWS - order, -1):
            pieces = scale * np.einsum("ik,pkj->pij", _DERIVED[: rows - 1, :rows], pieces)
        return pieces


def _chebyshev(times: Array, knots: Sequence[Knot]) -> Array:
    """Coefficients (pieces, ROWS, joints) of the pieces between knots."""
    count, joints = len(knots) - 1, len(knots[0].positions)
    h = np.diff(times)[:, None]
    p = np.array([knot.positions for knot in knots])
    v, curved = _given([knot.velocities for knot in knots], joints)
    a, bent = _given([knot.accelerations for knot in knots], joints)
    bent &= curved
    p0, p1, v0, v1 = p[:-1], p[1:], h * v[:-1], h * v[1:]
    a0, a1, way = h * h * a[:-1], h * h * a[1:], p1 - p0
    power = np.zeros((count, ROWS, joints))  # of u from 0 to 1
    power[:, 0], power[:, 1] = p0, way
    cubic, quintic = (curved & ~bent), bent
    rows = np.stack([p0, v0, 3.0 * way - 2.0 * v0 - v1, v0 + v1 - 2.0 * way], axis=1)
    power[cubic, :4] = rows[cubic]
    rows = np.stack(
        [
            p0,
            v0,
            0.5 * a0,
            10.0 * way - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1,
            -15.0 * way + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1,
            6.0 * way - 3.0 * v0 - 3.0 * v1 - 0.5 * a0 + 0.5 * a1,
        ],
        axis=1,
    )
    power[quintic] = rows[quintic]
    coefficients: Array = np.einsum("ik,pkj->pij", _FROM_POWERS, power)
    return coefficients


def _given(values: Sequence[Joints | None], joints: int) -> tuple[Array, NDArray[np.bool_]]:
    """Values (knots, joints), and of each piece whether both its knots have them."""
    there = np.array([value is not None for value in values])
    filled = np.array([[0.0] * joints if value is None else value for value in values])
    return filled, there[:-1] & there[1:]


def _from_powers() -> Array:
    """What each power of u = (x + 1) / 2 counts in each Chebyshev coefficient (6, 6): with x = cos(2 t) that
    is cos(t)^2, whose powers are binomial sums of cosines. Exact, as parts of 1,024."""
    rows = np.zeros((ROWS, ROWS))
    for power in range(ROWS):
        for k in range(power + 1):
            rows[k, power] = (2.0 if k else 1.0) * comb(2 * power, power - k) / 4.0**power
    return rows


_FROM_POWERS = _from_powers()

_DERIVED = np.array(
    [
        [(2.0 if row else 1.0) * of if of > row and (of - row) % 2 else 0.0 for of in range(ROWS)]
        for row in range(ROWS - 1)
    ]
)
"""What each Chebyshev coefficient of a polynomial counts in those of its derivative (5, 6). Numpy's own
would be imported when it is first needed, which held up the robot for 13 ms at its first trajectory."""
