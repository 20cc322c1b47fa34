"""Joint trajectories, given as points with times, and how the robot follows them within its limits.

The curve between two points is that of ros2_controllers' joint_trajectory_controller. It is a quintic if both
have velocities and accelerations, a cubic if both have velocities, else a straight line.

The robot follows an average of that curve over the time just behind, of two widths one after the other. An
average never leaves the range of its values. Averaging over T seconds keeps positions and velocities within
their limits, and bounds the next derivative by (range of this one) / T. The first average, T1 wide, is for
velocities that jump, as between straight lines, or change faster than the robot accelerates. The second, T2
wide, is for accelerations that do so. A curve within the limits of the robot is not averaged at
all. Else the robot is (T1 + T2) / 2 behind it.
"""

from collections.abc import Sequence
from functools import reduce
from math import comb, prod
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array, JointLimits
from iiwa_sim.motion.ruckig_trajectory import RuckigPlanner, RuckigTrajectory, State

ROWS = 6
"""Coefficients of a piece, which is a quintic at most."""
_PLACES = np.linspace(0.0, 1.0, 257)
"""Values of u at which bounds are checked."""
KEPT = 0.99
"""Part of the limits of acceleration and jerk that is used."""
SMOOTH = 1e-9
"""Part of a limit by which a continuous derivative may jump: rounding."""
NARROWEST_S = 1e-4
"""No average is narrower, but for none."""
FIRST_JOIN_S = 0.01
"""A robot that is beside the curve, or moves otherwise, is on it after so long at the soonest."""
JOIN_GROWTH = 1.5
"""If it cannot be, this many times that duration is tried next."""


class Knot(NamedTuple):
    """A point of a trajectory, its joints in the order of the robot's."""

    time_s: float
    """Since the trajectory has begun; a first knot may lie before that."""
    positions: Joints
    """rad"""
    velocities: Joints = ()
    """rad/s; may be empty."""
    accelerations: Joints = ()
    """rad/s^2; may be empty."""


Windows = tuple[float, float]
"""Widths of the two averages (s); their sum is how long after the end of the reference the robot rests."""


class Reference:
    """Joint positions (rad) over time (s) through knots, at rest before the first and behind the last."""

    def __init__(self, knots: Sequence[Knot]) -> None:
        """Take two knots at least, whose times rise; the last of them lies behind 0."""
        self.times = np.array([knot.time_s for knot in knots])
        """(pieces + 1,)"""
        self.start = knots[0].positions
        self.end = knots[-1].positions
        self.end_s = knots[-1].time_s
        self.pieces = _powers(self.times, knots)
        """Coefficients (pieces, ROWS, n) of powers of u, which goes from 0 to 1 over a piece."""

    def at(self, time_s: float) -> State:
        """Return positions (rad), velocities (rad/s) and accelerations (rad/s^2) at a time."""
        still = (0.0,) * len(self.start)
        if time_s >= self.end_s or time_s < self.times[0]:
            return self.end if time_s >= self.end_s else self.start, still, still
        k = int(self.times[1:-1].searchsorted(time_s, side="right"))
        piece, length_s = self.pieces[k : k + 1], np.diff(self.times[k : k + 2])
        u = (time_s - self.times[k]) / length_s[0]
        found: list[Joints] = []
        for _ in range(3):
            found.append(tuple(reduce(lambda value, row: value * u + row, piece[0, ::-1]).tolist()))
            piece = _differentiated(piece, length_s)
        return found[0], found[1], found[2]

    def first_beyond(self, order: int, lowest: Array, highest: Array) -> tuple[float, int] | None:
        """Return when which joint first leaves bounds (n,) of positions (order 0) or velocities (1)."""
        pieces = self._derivative(order)
        low, high = _bounds(pieces)
        piece, joint = ((low < lowest) | (high > highest)).nonzero()
        values = pieces[piece, :, joint] @ _PLACES ** np.arange(pieces.shape[1])[:, None]
        outside = (values < lowest[joint, None]) | (values > highest[joint, None])
        if not outside.any():
            return None
        u = _PLACES[outside.argmax(axis=1)]
        times = self.times[piece] + u * (self.times[piece + 1] - self.times[piece])
        times[~outside.any(axis=1)] = np.inf
        first = int(times.argmin())
        return max(float(times[first]), 0.0), int(joint[first])

    def range(self, order: int) -> tuple[Array, Array]:
        """Return width and largest magnitude (n,) of velocities (order 1), accelerations (2) or jerks (3).

        They include the standstill before and behind, and are a little wide for curves.
        """
        low, high = _bounds(self._derivative(order))
        lowest, highest = np.minimum(low.min(axis=0), 0.0), np.maximum(high.max(axis=0), 0.0)
        return highest - lowest, np.maximum(highest, -lowest)

    def largest_jump(self, order: int, *, from_rest: bool = True) -> Array:
        """Return how far velocities (order 1) or accelerations (2) jump at most (n,).

        The jump at the start counts where the joints come `from_rest`, that at the end always.
        """
        pieces = self._derivative(order)
        still = np.zeros((1, len(self.start)))
        before, after = np.concatenate([still, pieces.sum(axis=1)]), np.concatenate([pieces[:, 0], still])
        largest: Array = np.abs(after - before)[0 if from_rest else 1 :].max(axis=0)
        return largest

    def _derivative(self, order: int) -> Array:
        """Return coefficients (pieces, ROWS - order, n) of a derivative by time."""
        pieces = self.pieces
        for _ in range(order):
            pieces = _differentiated(pieces, np.diff(self.times))
        return pieces


def windows_of(reference: Reference, limits: JointLimits, *, from_rest: bool = True) -> Windows:
    """Return the widths (s) of both averages that keep the limits of acceleration and jerk.

    The reference keeps those of velocity. `from_rest` is True if the robot stands still at its start. Else
    the start is no part of the averages: the robot joins later than they are wide.
    """
    most_a, most_j = KEPT * limits.acceleration, KEPT * limits.jerk
    (speeds, _), (accelerations, largest), (_, jerks) = (reference.range(order) for order in (1, 2, 3))
    jumps = reference.largest_jump(1, from_rest=from_rest) > SMOOTH * limits.velocity
    too_fast = jumps | (largest > most_a)
    if too_fast.any():
        first_s = _width(speeds / most_a, too_fast)
        most = speeds / first_s
        most[~jumps] = most[~jumps].clip(max=largest[~jumps])
        return first_s, _width(2.0 * most / most_j, most > 0.0)
    sudden = reference.largest_jump(2, from_rest=from_rest) > SMOOTH * limits.acceleration
    return 0.0, _width(accelerations / most_j, sudden | (jerks > most_j))


class JointTrajectory:
    """Trajectory along the average of a reference, on which the robot is from `join_s` on.

    A robot that begins beside the average, or with another velocity, first joins it by a Ruckig trajectory
    that is there soonest. Positions, velocities, accelerations and jerks keep their limits at every time. At
    the end the robot holds the last point.
    """

    def __init__(
        self,
        reference: Reference,
        windows: Windows,
        join: RuckigTrajectory | None = None,
        join_s: float = 0.0,
    ) -> None:
        """`join` leads from where the robot is onto the average at `join_s`; None if it is there already."""
        self.reference = reference
        self.end = reference.end
        """The last point (rad)."""
        self.end_s = reference.end_s + sum(windows)
        """When the robot rests there."""
        self.join_s = join_s
        self._join = join
        self._widths = tuple(width for width in windows if width)
        # A standstill before and behind, as long as the average looks back.
        times, pieces = reference.times, reference.pieces
        self._knots = np.array([times[0] - sum(windows) - 1.0, *times, self.end_s + 1.0])
        still = np.zeros((2, 1, *pieces.shape[1:]))
        still[:, 0, 0] = reference.start, reference.end
        self._pieces = np.concatenate([still[0], pieces, still[1]])

    def joints(self, time_s: float) -> Joints:
        """Return joint positions (rad) at a time."""
        if time_s >= self.end_s:
            return self.end
        if time_s < self.join_s and self._join is not None:
            return self._join.joints(time_s)
        return self._averaged(time_s, 0)

    def sample(self, times: Array) -> Array:
        """Return joint positions (m, n) at rising times (m,) before the end."""
        count = int(times.searchsorted(self.join_s)) if self._join is not None else 0
        joining = [self.joints(time_s) for time_s in times[:count].tolist()]
        return np.concatenate(
            [
                np.array(joining).reshape(count, len(self.end)),
                averaged(self._knots, self._pieces, self._widths, times[count:], 0),
            ]
        )

    def state(self, time_s: float) -> State:
        """Return joint positions, velocities and accelerations at a time."""
        if time_s >= self.end_s:
            return self.reference.at(time_s)
        if time_s < self.join_s and self._join is not None:
            return self._join.state(time_s)
        return self._averaged(time_s, 0), self._averaged(time_s, 1), self._averaged(time_s, 2)

    def _averaged(self, time_s: float, order: int) -> Joints:
        return tuple(averaged(self._knots, self._pieces, self._widths, np.array([time_s]), order)[0].tolist())


def joint_trajectory(
    reference: Reference, state: State, limits: JointLimits, planner: RuckigPlanner
) -> JointTrajectory:
    """Return the trajectory along a reference, within limits, from a state of motion.

    Raises `ArithmeticError` if no trajectory that joins it is found.
    """
    still = (0.0,) * len(reference.end)
    joins = state != (reference.start, still, still) or reference.times[0] != 0.0
    windows = windows_of(reference, limits, from_rest=not joins)
    smoothed = JointTrajectory(reference, windows)
    if not joins:
        return smoothed
    straight = planner.find(state, (reference.end, still, still), limits)
    if straight is None or straight.end_s < reference.end_s:
        join_s = max(sum(windows), FIRST_JOIN_S)
        while join_s < smoothed.end_s:
            joining = planner.find(state, smoothed.state(join_s), limits, join_s)
            if joining is not None:
                return JointTrajectory(reference, windows, joining, join_s)
            join_s *= JOIN_GROWTH
    if straight is None:
        raise ArithmeticError("Ruckig: no trajectory that joins the requested one")
    at_once = JointTrajectory(reference, windows, straight, straight.end_s)
    at_once.end_s = straight.end_s
    return at_once


def averaged(knots: Array, pieces: Array, widths: Sequence[float], times: Array, order: int) -> Array:
    """Return a derivative (m, n) of a curve at rising times (m,), averaged over widths one after the other.

    `pieces` are those of `Reference.pieces` between `knots`. An average of width w is the difference of the
    curve's integral at t and t - w, over w. Two widths take the second integral at four times. Integrals
    begin just before the first of these, so that no digits are lost.
    """
    shifts, signs = np.zeros(1), np.ones(1)
    for width in widths:
        shifts, signs = np.append(shifts, shifts + width), np.append(signs, -signs)
    at = times[:, None] - shifts
    if not at.size:
        return np.empty((0, pieces.shape[2]))
    piece = knots[1:-1].searchsorted(at, side="right")
    first, last = int(piece.min()), int(piece.max()) + 1
    lengths = np.diff(knots[first : last + 1])
    c, origin = pieces[first:last].copy(), pieces[first, 0].copy()
    c[:, 0] -= origin
    for _ in range(len(widths) - order):
        c = _integrated(c, lengths)
    for _ in range(order - len(widths)):
        c = _differentiated(c, lengths)
    u = ((at - knots[piece]) / lengths[piece - first])[..., None]
    rows = np.moveaxis(c, 1, 0)[:, piece - first]
    value = rows[-1]
    for row in rows[-2::-1]:
        value = value * u + row
    found: Array = np.einsum("s,msn->mn", signs / prod(widths), value)
    return found + origin if order == 0 else found


def _powers(times: Array, knots: Sequence[Knot]) -> Array:
    """Return coefficients (pieces, ROWS, joints) of the pieces between knots."""
    count, joints = len(knots) - 1, len(knots[0].positions)
    h = np.diff(times)[:, None]
    p = np.array([knot.positions for knot in knots])
    v, curved = _given([knot.velocities for knot in knots], joints)
    a, bent = _given([knot.accelerations for knot in knots], joints)
    bent &= curved
    p0, p1, v0, v1 = p[:-1], p[1:], h * v[:-1], h * v[1:]
    a0, a1, dp = h * h * a[:-1], h * h * a[1:], p1 - p0
    power = np.zeros((count, ROWS, joints))
    power[:, 0], power[:, 1] = p0, dp
    cubic, quintic = (curved & ~bent), bent
    rows = np.stack([p0, v0, 3.0 * dp - 2.0 * v0 - v1, v0 + v1 - 2.0 * dp], axis=1)
    power[cubic, :4] = rows[cubic]
    rows = np.stack(
        [
            p0,
            v0,
            0.5 * a0,
            10.0 * dp - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1,
            -15.0 * dp + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1,
            6.0 * dp - 3.0 * v0 - 3.0 * v1 - 0.5 * a0 + 0.5 * a1,
        ],
        axis=1,
    )
    power[quintic] = rows[quintic]
    return power


def _given(values: Sequence[Joints], joints: int) -> tuple[Array, NDArray[np.bool_]]:
    """Return values (knots, joints), and of each piece whether both its knots have them."""
    there = np.array([len(value) > 0 for value in values])
    filled = np.array([value or [0.0] * joints for value in values])
    return filled, there[:-1] & there[1:]


def _integrated(pieces: Array, lengths: Array) -> Array:
    """Return coefficients of the integral over time (s), which is 0 where the first piece begins."""
    count, rows, joints = pieces.shape
    integral = np.zeros((count, rows + 1, joints))
    integral[:, 1:] = pieces * (lengths[:, None] / np.arange(1.0, rows + 1.0))[..., None]
    integral[1:, 0] = integral.sum(axis=1)[:-1].cumsum(axis=0)
    return integral


def _differentiated(pieces: Array, lengths: Array) -> Array:
    """Return coefficients of the derivative by time (s)."""
    return pieces[:, 1:] * (np.arange(1.0, pieces.shape[1]) / lengths[:, None])[..., None]


def _bounds(pieces: Array) -> tuple[Array, Array]:
    """Return bounds (pieces, n): no polynomial goes farther than the sum of its Chebyshev coefficients."""
    rows = pieces.shape[1]
    chebyshev = np.einsum("ik,pkj->pij", _CHEBYSHEV[:rows, :rows], pieces)
    middle, reach = chebyshev[:, 0], np.abs(chebyshev[:, 1:]).sum(axis=1)
    return middle - reach, middle + reach


def _width(widths_s: Array, needed: NDArray[np.bool_]) -> float:
    return max(float(widths_s[needed].max()), NARROWEST_S) if needed.any() else 0.0


_CHEBYSHEV = np.array(
    [
        [
            (2.0 if k else 1.0) * comb(2 * power, power - k) / 4.0**power if k <= power else 0.0
            for power in range(ROWS)
        ]
        for k in range(ROWS)
    ]
)
"""Parts of each power of u in each Chebyshev coefficient, exact as parts of 1,024.
With 2 u - 1 = cos 2t, u is cos(t)^2, whose powers are binomial sums of cosines."""
