"""Inverse kinematics in closed form: dimensions of the arm, branches, neighbourhood of singular poses.

An arm has up to eight branches, which three bits of the status tell apart. Bit 0 is set where the wrist point
has a negative x in the frame that A1 turns, the overhead area. Bit 1 is set where A4 of an S-R-S arm is
negative, or A3 of a six-joint arm is at the stretched arm or beyond. Bit 2 is set where A6 of an
S-R-S arm is zero or negative, or A5 of a six-joint arm is above zero.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import atan2, cos, hypot, isnan, nan, pi, remainder, sin, tau
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iiwa_sim.frames import Transform, Vector, apply, transpose, turn_between
from iiwa_sim.robot.arm_kernel import NEAR, OPW, OUT_OF_REACH, SRS, branch, solve
from iiwa_sim.robot.description import RobotFault
from iiwa_sim.robot.model import Model

# With less than this (rad) between the axes of two wrist joints one of them is free.
_ALIGNED = 1e-9
# Wider than the neighbourhood in which the seed is followed: lines keep out of it.
_STRETCHED_RAD = 1e-3
_SIDEWAYS_M = 1e-4
# A seed farther from the pose than this (m or rad) is not followed. It has reached the pose when it is as
# close as `_CLOSED`, in `_STEPS` steps of at most `_LARGEST_STEP` (m and rad).
_FOLLOWED = 0.02
_CLOSED = 5e-10
_STEPS = 8
_LARGEST_STEP = 0.05

# Joint positions (rad) that exceed a limit by rounding are set to it: replies have nine decimals.
_ROUNDING = 5e-10
# Error of a URDF written with seven decimals; a larger error would show in the poses.
_TOLERANCE = 1e-7
# Joint axes at zero pose, in the base; those of a six-joint arm up to their sense.
_SRS_AXES = ((0, 0, 1), (0, 1, 0), (0, 0, 1), (0, -1, 0), (0, 0, 1), (0, 1, 0), (0, 0, 1))
_OPW_AXES = ((0, 0, 1), (0, 1, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0))

_GEOMETRY = {
    "srs": "axes of A1 to A3 that cross in the shoulder, axes of A5 to A7 that cross in the wrist, and at "
    "zero pose shoulder, elbow, wrist and flange above the base",
    "opw": "axes of A4 to A6 that cross in the wrist, and at zero pose all axes but A1 and the flange in the "
    "plane y = 0",
}


class Dimensions(NamedTuple):
    """An arm as its closed form takes it."""

    kind: int
    """SRS or OPW of `iiwa_sim.robot.arm_kernel`."""
    numbers: tuple[float, ...]
    """The dimensions as the compiled solver of that kind takes them."""
    meetings: tuple[tuple[int, float], ...]
    """Joint, and its position, at which the branches of bit 1 meet, then of bit 2 (rad)."""
    sideways: str
    """The place of the wrist at which the branches of bit 0 meet, in words."""
    shoulder: tuple[float, float]
    """x and z of A2 in the base with A1 at zero (m)."""
    upper: float
    """Length of the upper arm (m)."""
    fore: float
    """Length from the elbow to the wrist point (m)."""
    wrist_in_flange: Vector
    """m"""


class Inverse:
    """Joint positions for a pose of the flange in the base (m). Joints and redundancy are rad.

    The status selects a branch; where two merge, at a singular pose, either may be selected. A joint that is
    free there keeps its position in the seed. `within_limits` and `nearest` check joint limits; the other
    methods do not, and their angles are in (-pi, pi]. An arm without redundancy ignores it.
    """

    statuses = range(8)

    def __init__(self, model: Model) -> None:
        """Raises `RobotFault` for an unknown kind, and if the geometry of the URDF is not of that kind."""
        d = model.description
        if d.kinematics not in ("srs", "opw"):
            raise RobotFault(d.settings_path, "kinematics", repr(d.kinematics), "'srs' or 'opw'")
        self.model = model
        _check_axes(model, _SRS_AXES if d.kinematics == "srs" else _OPW_AXES, d.kinematics)
        self._dimensions = _srs_dimensions(model) if d.kinematics == "srs" else _opw_dimensions(model)
        self.kind = self._dimensions.kind
        self.numbers: NDArray[np.float64] = np.array(self._dimensions.numbers)
        self._redundant = 2 if self.kind == SRS else None
        self.redundancy_range = (d.position_min[2], d.position_max[2]) if self.kind == SRS else None
        """Least and greatest redundancy within the joint limits; None for a robot without redundancy."""
        self._lowest, self._highest = np.array(d.position_min), np.array(d.position_max)
        self._check_closed_form()

    def _check_closed_form(self) -> None:
        """Check that the closed form returns some joint positions from their poses: the geometry suits it."""
        for turn in (0.3, -0.5, 0.9):
            q = [turn * (1.0 + 0.2 * joint) for joint in range(self.model.joint_count)]
            flange = self.model.flange(q)
            found = self.joints(flange, self.redundancy(q), self.status(q), q)
            if found is None or np.abs(np.subtract(found, q)).max() > _TOLERANCE:
                d = self.model.description
                raise RobotFault(d.urdf_path, "kinematics", repr(d.kinematics), _GEOMETRY[d.kinematics])

    def joints(
        self, flange: Transform, redundancy: float, status: int, seed: Sequence[float]
    ) -> tuple[float, ...] | None:
        """Return joint positions on one branch, or None where it does not reach the pose."""
        found = self.joints_batch(flange, np.array([redundancy]), np.array([status]), seed)[0].tolist()
        return None if isnan(found[0]) else tuple(found)

    def joints_batch(
        self,
        flange: Transform,
        redundancies: NDArray[np.float64],
        statuses: NDArray[np.int64],
        seed: Sequence[float],
    ) -> NDArray[np.float64]:
        """Return joint positions (m, n) for redundancies and statuses (m,); rows out of reach are NaN."""
        count = len(redundancies)
        poses = np.tile((*flange.rotation, *flange.translation), (count, 1))
        found, results = np.empty((count, self.model.joint_count)), np.empty(count, dtype=np.int64)
        start = np.array(seed, float)
        solve(self.kind, self.numbers, poses, redundancies, statuses, start, _ALIGNED, found, results)
        found[results == OUT_OF_REACH] = np.nan
        for row in np.flatnonzero(results == NEAR).tolist():
            followed = self.followed(flange, float(redundancies[row]), int(statuses[row]), seed)
            if followed is not None:
                found[row] = followed
        return found

    def within_limits(
        self, flange: Transform, redundancy: float, status: int, present: Sequence[float]
    ) -> tuple[float, ...] | None:
        """Return joint positions on one branch, in the turns within the limits nearest to the present ones.

        Return None if the branch does not reach the pose, or not within the limits.
        """
        joints = self.joints(flange, redundancy, status, present)
        if joints is None:
            return None
        turned, within = self.turned(np.array(joints), present)
        return tuple(turned.tolist()) if within else None

    def turned(
        self, joints: NDArray[np.float64], present: Sequence[float]
    ) -> tuple[NDArray[np.float64], Any]:
        """Move joint positions (..., n) by whole turns, within limits, to be nearest to the present ones.

        Return them, and whether each row is within the limits, which NaN is not.
        """
        low, high = self._lowest, self._highest
        fewest, most = np.ceil((low - _ROUNDING - joints) / tau), np.floor((high + _ROUNDING - joints) / tau)
        turns = np.clip(np.floor((present - joints) / tau + 0.5), fewest, most)
        turned = joints + tau * np.where(fewest <= most, turns, 0.0)
        clipped = np.clip(turned, low, high)
        within = np.all(np.abs(turned - clipped) <= 2.0 * _ROUNDING, axis=-1)
        return np.where(within[..., None], clipped, turned), within

    def nearest(
        self, flange: Transform, redundancy: float, statuses: Iterable[int], present: Sequence[float]
    ) -> tuple[tuple[float, ...], int] | None:
        """Return the nearest joint positions within limits, of some branches, with status; None for none."""
        found = [(self.within_limits(flange, redundancy, status, present), status) for status in statuses]
        reached = [(joints, status) for joints, status in found if joints is not None]
        if not reached:
            return None
        return min(reached, key=lambda each: sum((a - b) ** 2 for a, b in zip(each[0], present, strict=True)))

    def followed(
        self, flange: Transform, redundancy: float, status: int, seed: Sequence[float]
    ) -> tuple[float, ...] | None:
        """Return the joint positions on a branch next to the seed, by least changes of joints from the seed.

        At a meeting of branches a joint goes with the square root of the pose. Rounding of 1e-16 in the pose
        shows as 1e-8 in that joint. A second singularity turns that into any error of a third joint.

        Returns:
            Joint positions in (-pi, pi]; None if the seed is not near the pose, or if least changes do not
            reach it.
        """
        q = list(seed)
        free = list(range(len(q)))
        if self._redundant is not None:
            q[self._redundant] = redundancy
            free.remove(self._redundant)
        self._keep_sides(q, status, free)
        error = self._error(flange, q)
        if float(np.abs(error).max()) > _FOLLOWED:
            return None
        for _ in range(_STEPS):
            if float(np.abs(error).max()) <= _CLOSED:
                break
            change = _least_change(self.model.tcp_of_flange.jacobian(q)[:, free], error)
            if float(np.abs(change).max()) > _LARGEST_STEP:
                return None
            for joint, value in zip(free, change.tolist(), strict=True):
                q[joint] += value
            for joint in self._keep_sides(q, status, free):
                free.remove(joint)
            error = self._error(flange, q)
        else:
            return None
        wrist_x = self.distances(q)[0]
        if (wrist_x > 1e-9 and status & 1) or (wrist_x < -1e-9 and not status & 1):
            return None
        return tuple(value if -pi < value <= pi else remainder(value, tau) for value in q)

    def _keep_sides(self, q: list[float], status: int, free: Sequence[int]) -> list[int]:
        """Move joints that are on the other side of a meeting of branches to the meeting; return these."""
        moved = []
        for bit, (joint, meeting) in zip((2, 4), self._dimensions.meetings, strict=True):
            below = bool(status & bit) == (self.kind == SRS)
            if joint in free and (q[joint] > meeting if below else q[joint] < meeting):
                q[joint] = meeting
                moved.append(joint)
        return moved

    def _error(self, flange: Transform, q: Sequence[float]) -> NDArray[np.float64]:
        """Return the error of a pose (6,): translation (m), then the rotation vector in the base (rad)."""
        reached = self.model.flange(q)
        axis, angle = turn_between(reached.rotation, flange.rotation)
        return np.append(np.subtract(flange.translation, reached.translation), np.multiply(angle, axis))

    def status(self, q: Sequence[float]) -> int:
        """Return the branch of joint positions."""
        return int(branch(self.kind, self.numbers, np.array(q, float), np.empty(3)))

    def distances(self, q: Sequence[float]) -> tuple[float, float, float]:
        """Return distances (m or rad) of joint positions from the singularity of each bit of the status."""
        distances = np.empty(3)
        branch(self.kind, self.numbers, np.array(q, float), distances)
        first, second, third = distances.tolist()
        return first, second, third

    def merging_statuses(self, q: Sequence[float], near: float = 1e-6) -> Sequence[int]:
        """Return the statuses of the branches that meet at joint positions, their own first.

        There are several at singular poses: positions within `near` (rad, m) of them count as singular.
        """
        statuses = [self.status(q)]
        for bit, distance in enumerate(self.distances(q)):
            if -near < distance < near:
                statuses += [status ^ (1 << bit) for status in statuses]
        return statuses

    def turning_point(self, q: Sequence[float]) -> str | None:
        """Return the kind of singularity at which no straight line can start or end; None elsewhere.

        There joints go with the square root of the pose, or one of them may have to turn at once to follow
        a line. A stretched wrist does not count.
        """
        sideways, bend, _ = self.distances(q)
        if abs(bend) < _STRETCHED_RAD:
            return "the arm is stretched"
        return self._dimensions.sideways if abs(sideways) < _SIDEWAYS_M else None

    def redundancy(self, q: Sequence[float]) -> float:
        """Return the redundancy of joint positions; 0 for a robot without redundancy."""
        return 0.0 if self._redundant is None else q[self._redundant]

    def beyond_reach(self, flange: Transform) -> float:
        """Return how far (m) the wrist point is beyond reach.

        Above 0 it is too far away, below 0 too near. 0 is within reach, regardless of joint limits and
        redundancy.
        """
        d = self._dimensions
        x, y, z = apply(flange, d.wrist_in_flange)
        out = hypot(x, y)
        found = []
        for side in (out, -out):  # before the shoulder, or in the overhead area behind it
            away = hypot(side - d.shoulder[0], z - d.shoulder[1])
            found.append(max(away - d.upper - d.fore, 0.0) + min(away - abs(d.upper - d.fore), 0.0))
        return min(found, key=abs)


def _least_change(jacobian: NDArray[np.float64], error: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the least change of joints that reduces the error to `_CLOSED`, by strong directions."""
    u, sigma, vt = np.linalg.svd(jacobian, full_matrices=False)
    parts = u.T @ error
    missing = (parts**2)[::-1].cumsum()[::-1]  # by this direction and the weaker ones
    used = (missing > (0.3 * _CLOSED) ** 2) & (sigma > 1e-12)
    change: NDArray[np.float64] = (parts[used] / sigma[used]) @ vt[used]
    return change


def _srs_dimensions(model: Model) -> Dimensions:
    """Return dimensions of a seven-joint arm with spherical shoulder and wrist.

    At zero pose the arm stands upright on the base. A1, A3, A5, A7 turn about its z axis, A2 and A6 about
    parallels to y through that axis, A4 about a parallel to -y.
    """
    shoulder, elbow, wrist = model.points[[1, 3, 5], 2].tolist()
    upper, fore = elbow - shoulder, wrist - elbow
    hand = model.flange([0.0] * model.joint_count).translation[2] - wrist
    sideways = "the wrist is on the axis of A1, or beside it as far as A3 allows"
    meetings = ((3, 0.0), (5, 0.0))
    numbers = (shoulder, upper, fore, hand)
    return Dimensions(SRS, numbers, meetings, sideways, (0.0, shoulder), upper, fore, (0.0, 0.0, -hand))


def _opw_dimensions(model: Model) -> Dimensions:
    """Return dimensions of a six-joint arm with a spherical wrist.

    At zero pose A1 turns about the z axis of the base, A2, A3 and A5 about parallels to its y axis. A4 and A6
    turn about one and the same parallel to its x axis, which A5 crosses. Every joint but A1 is in the plane
    y = 0, and the flange is on the axis of A6.
    """
    rotation, flange = model.flange([0.0] * model.joint_count)
    (x2, _, z2), (x3, _, z3), (x5, _, z5) = model.points[[1, 2, 4]].tolist()
    ux, uz, fx, fz = x3 - x2, z3 - z2, x5 - x3, z5 - z3
    upper, fore, hand = hypot(ux, uz) or nan, hypot(fx, fz), flange[0] - x5
    signs = np.sign(model.axes.sum(axis=1)).tolist()
    unturned = transpose(rotation)
    bend = atan2(ux * fz - uz * fx, ux * fx + uz * fz)  # of A3 about y from zero to the stretched arm
    stretched = signs[2] * bend
    lengths = (fore / upper, (upper + fore) ** 2, 0.25 / (upper * (fore or nan)))
    bent = (sin(bend), cos(bend))
    numbers = (x2, z2, ux, uz, hand, *lengths, *bent, *signs, *unturned, fx, fz, stretched)
    meetings = ((2, stretched), (4, 0.0))
    wrist_in_flange = (-hand * unturned[0], -hand * unturned[3], -hand * unturned[6])
    sideways = "the wrist is on the axis of A1"
    return Dimensions(OPW, numbers, meetings, sideways, (x2, z2), upper, fore, wrist_in_flange)


def _check_axes(model: Model, axes: Sequence[Sequence[int]], kinematics: str) -> None:
    """Check number and directions of the joints at zero pose; those of 'opw' may have either sense."""
    d = model.description
    if model.joint_count != len(axes):
        expected = f"{len(axes)} joints for kinematics '{kinematics}'"
        raise RobotFault(d.settings_path, "joints", list(d.joints), expected)
    directions = model.axes if kinematics == "srs" else np.abs(model.axes)
    for name, axis, direction, shown in zip(d.joints, axes, directions, model.axes, strict=True):
        if np.abs(direction - axis).max() > _TOLERANCE:
            x, y, z = axis
            sense = f"{x} {y} {z}" if kinematics == "srs" else f"+-({x} {y} {z})"
            expected = f"at zero pose {sense} in the base, as kinematics '{kinematics}' has it"
            raise RobotFault(d.urdf_path, f"joint {name}: axis", _shown(shown), expected)


def _shown(vector: ArrayLike) -> str:
    return " ".join(f"{value + 0.0:.9g}" for value in np.asarray(vector).tolist())
