"""The inverse kinematics of all arms: in closed form, for one pose, for many, and for other kernels."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import cython
import numpy as np
from numpy.typing import NDArray

from iiwa_sim.frames import Transform
from iiwa_sim.robot.closed_form import ClosedForm
from iiwa_sim.robot.follow import follow_seed
from iiwa_sim.robot.model import Model

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.opw_kernel import branch as branch_of_opw
    from cython.cimports.iiwa_sim.robot.opw_kernel import solve as solve_opw
    from cython.cimports.iiwa_sim.robot.srs_kernel import branch as branch_of_srs
    from cython.cimports.iiwa_sim.robot.srs_kernel import solve as solve_srs
    from cython.cimports.iiwa_sim.robot.turns_kernel import clip, turn
else:
    from iiwa_sim.robot.opw_kernel import branch as branch_of_opw
    from iiwa_sim.robot.opw_kernel import solve as solve_opw
    from iiwa_sim.robot.srs_kernel import branch as branch_of_srs
    from iiwa_sim.robot.srs_kernel import solve as solve_srs
    from iiwa_sim.robot.turns_kernel import clip, turn

SRS = 0
OPW = 1
_OPW = cython.declare(cython.int, 1)

REGULAR = 0
NEAR = 1
OUT_OF_REACH = 2
_NEAR = cython.declare(cython.int, 1)
_OUT_OF_REACH = cython.declare(cython.int, 2)

# With less than this (rad) between the axes of two wrist joints one of them is free.
_ALIGNED = cython.declare(cython.double, 4e-10)
# Wider than the neighbourhood in which the seed is followed: lines keep out of it.
_STRETCHED_RAD = cython.declare(cython.double, 1e-3)
_SIDEWAYS_M = cython.declare(cython.double, 1e-4)


@cython.ccall
@cython.exceptval(check=False)
def solve(
    kind: cython.int,
    numbers: cython.double[::1],
    poses: cython.double[:, ::1],
    row: cython.Py_ssize_t,
    redundancy: cython.double,
    status: cython.int,
    seed: cython.double[::1],
    aligned: cython.double,
    joints: cython.double[:, ::1],
) -> cython.int:
    """See `iiwa_sim.robot.srs_kernel.solve`; `kind` selects the closed form, `numbers` are its dimensions."""
    if kind == _OPW:
        return solve_opw(numbers, poses, row, redundancy, status, seed, aligned, joints)
    return solve_srs(numbers, poses, row, redundancy, status, seed, aligned, joints)


@cython.cclass
class Inverse:
    """Joint positions for a pose of the flange in the base (m). Joints and redundancy in rad.

    The status selects a branch; where two merge, at a singular pose, either may be selected. A joint that is
    free there keeps its position in the seed. Where a name does not say so, joint limits are not checked, and
    angles are in (-pi, pi], see `iiwa_sim.robot.turns_kernel`. An arm without redundancy ignores it.
    """

    def __init__(self, model: Model, form: ClosedForm) -> None:
        d = model.description
        self.model = model
        self.kind = form.kind
        self.numbers: NDArray[np.float64] = np.array(form.numbers)
        self._numbers = self.numbers
        self.statuses = range(8)
        """All there are."""
        redundant = self._redundant = form.redundant
        self.redundancy_range = (
            None if redundant is None else (d.position_min[redundant], d.position_max[redundant])
        )
        """Least and greatest redundancy within the joint limits; None for a robot without redundancy."""
        self._form = form
        self._count = len(d.joints)
        self._lowest, self._highest = np.array(d.position_min), np.array(d.position_max)
        self._pose, self._found = np.empty((1, 12)), np.empty((1, self._count))
        self._seed, self._q = np.empty(self._count), np.empty(self._count)
        self._distances = np.empty(3)

    def joints(
        self, flange: Transform, redundancy: cython.double, status: cython.int, seed: Sequence[float]
    ) -> tuple[float, ...] | None:
        """Joint positions on one branch, or None where it does not reach the pose."""
        rotation, place = flange
        for k in range(9):
            self._pose[0, k] = rotation[k]
        for k in range(3):
            self._pose[0, 9 + k] = place[k]
        for k in range(self._count):
            self._seed[k] = seed[k]
        result: cython.int = solve(
            self.kind, self._numbers, self._pose, 0, redundancy, status, self._seed, _ALIGNED, self._found
        )
        if result == _OUT_OF_REACH:
            return None
        solved = tuple([self._found[0, k] for k in range(self._count)])
        return (self.followed(flange, redundancy, status, seed) if result == _NEAR else None) or solved

    def followed(
        self, flange: Transform, redundancy: float, status: int, seed: Sequence[float]
    ) -> tuple[float, ...] | None:
        """The joint positions on that branch next to the seed, if it is next to the pose."""
        start = list(seed)
        if self._redundant is not None:
            start[self._redundant] = redundancy
        q = follow_seed(self.model, flange, start, self._form.sides[status], self._redundant)
        if q is None:
            return None
        self._branch(q)
        x: cython.double = self._distances[0]
        if (x > 1e-9 and status & 1) or (x < -1e-9 and not status & 1):
            return None
        return q

    def beyond_reach(self, flange: Transform) -> float:
        """How far (m) the wrist point is beyond reach, see `iiwa_sim.robot.closed_form.Reach.beyond`."""
        far: float = self._form.reach.beyond(flange)
        return far

    def branches(
        self, flange: Transform, redundancy: float, seed: Sequence[float]
    ) -> list[tuple[int, tuple[float, ...]]]:
        """Status and joint positions of each branch that reaches the pose."""
        found = [(status, self.joints(flange, redundancy, status, seed)) for status in self.statuses]
        return [(status, joints) for status, joints in found if joints is not None]

    def within_limits(
        self, flange: Transform, redundancy: float, status: int, present: Sequence[float]
    ) -> tuple[float, ...] | None:
        """Joint positions on one branch, in the turns that are within the limits and nearest to the present
        ones; None where the branch does not reach the pose, or not within the limits."""
        joints = self.joints(flange, redundancy, status, present)
        if joints is None:
            return None
        for k in range(self._count):
            self._found[0, k] = joints[k]
        turn(self._found, 0, self._seed, self._lowest, self._highest)
        if not clip(self._found, 0, self._lowest, self._highest):
            return None
        return tuple([self._found[0, k] for k in range(self._count)])

    def nearest(
        self, flange: Transform, redundancy: float, statuses: Iterable[int], present: Sequence[float]
    ) -> tuple[tuple[float, ...], int] | None:
        """Joint positions nearest to the present ones, of those that `within_limits` finds on some branches,
        and the status of their branch; None where there are none."""
        best: tuple[tuple[float, ...], int] | None = None
        least: cython.double = 0.0
        for status in statuses:
            joints = self.within_limits(flange, redundancy, status, present)
            if joints is None:
                continue
            distance: cython.double = 0.0
            for k in range(self._count):
                way: cython.double = self._found[0, k] - self._seed[k]
                distance += way * way
            if best is None or distance < least:
                best, least = (joints, status), distance
        return best

    def joints_batch(
        self,
        rotations: NDArray[np.float64],
        translations: NDArray[np.float64],
        redundancies: NDArray[np.float64],
        status: int | NDArray[np.int64],
        seed: Sequence[float],
    ) -> NDArray[np.float64]:
        """Joint positions (N, n) for rotations (N, 3, 3), translations (N, 3) and redundancies (N,).

        The status is one for all or (N,). Rows out of reach are NaN.
        """
        count = len(redundancies)
        poses = np.empty((count, 12))
        poses[:, :9] = np.reshape(rotations, (count, 9))
        poses[:, 9:] = translations
        found: NDArray[np.float64] = np.empty((count, self._count))
        near: list[int] = []
        row: cython.Py_ssize_t
        pose: cython.double[:, ::1] = poses
        place: cython.double[::1] = np.array(redundancies, dtype=np.float64)
        branch: cython.longlong[::1] = np.array(np.broadcast_to(status, count), dtype=np.int64)
        joints: cython.double[:, ::1] = found
        for k in range(self._count):
            self._seed[k] = seed[k]
        for row in range(count):
            result: cython.int = solve(
                self.kind, self._numbers, pose, row, place[row], branch[row], self._seed, _ALIGNED, joints
            )
            if result == _NEAR:
                near.append(row)
            elif result == _OUT_OF_REACH:
                found[row] = np.nan
        for row in near:
            r0, r1, r2, r3, r4, r5, r6, r7, r8, x, y, z = poses[row].tolist()
            flange = Transform((r0, r1, r2, r3, r4, r5, r6, r7, r8), (x, y, z))
            followed = self.followed(flange, place[row], branch[row], seed)
            if followed is not None:
                found[row] = followed
        return found

    def status(self, q: Sequence[float]) -> int:
        """The branch of joint positions."""
        status: int = self._branch(q)
        return status

    def merging_statuses(self, q: Sequence[float], near: cython.double = 1e-6) -> Sequence[int]:
        """The statuses of the branches that meet at joint positions, their own first: several at singular
        poses.

        Positions count as singular within `near` (rad, m).
        """
        statuses: list[int] = [self._branch(q)]
        for bit in range(3):
            if -near < self._distances[bit] < near:
                statuses += [status ^ (1 << bit) for status in statuses]
        return statuses

    def distances(self, q: Sequence[float]) -> tuple[float, float, float]:
        """How far (m or rad) joint positions are from where the branches of each bit of the status meet."""
        self._branch(q)
        return self._distances[0], self._distances[1], self._distances[2]

    def turning_point(self, q: Sequence[float]) -> str | None:
        """The kind of singularity at which no straight line can start or end; None elsewhere.

        There, unlike at a stretched wrist, joints go with the square root of the pose, or one of them may
        have to turn at once to follow a line.
        """
        self._branch(q)
        if -_STRETCHED_RAD < self._distances[1] < _STRETCHED_RAD:
            return "the arm is stretched"
        if -_SIDEWAYS_M < self._distances[0] < _SIDEWAYS_M:
            sideways: str = self._form.sideways
            return sideways
        return None

    def redundancy(self, q: Sequence[float]) -> float:
        """The redundancy of joint positions; 0 for a robot without redundancy."""
        return 0.0 if self._redundant is None else q[self._redundant]

    @cython.cfunc
    @cython.exceptval(-1)
    def _branch(self, q: Any) -> cython.int:
        """The status of joint positions, whose distances from other branches are then known."""
        for k in range(self._count):
            self._q[k] = q[k]
        if self.kind == _OPW:
            return branch_of_opw(self._numbers, self._q, self._distances)
        return branch_of_srs(self._numbers, self._q, self._distances)
