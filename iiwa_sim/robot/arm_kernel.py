"""The arm in compiled code: forward kinematics of the TCP, inverse kinematics in closed form, whole turns.

Lengths are m, angles rad. A pose is twelve numbers: nine of the rotation, row by row, and the translation.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, pi
from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import atan2, cos, fabs, floor, remainder, sin, sqrt
from numpy.typing import NDArray

from iiwa_sim.frames import Transform, compose, inverse
from iiwa_sim.wrench import Wrench

SRS = 0
"""Seven joints with spherical shoulder and wrist; the redundancy is the position of A3."""
OPW = 1
"""Six joints, an ortho-parallel base and a spherical wrist without lateral offset."""
REGULAR = 0
NEAR = 1
"""Near a singular pose, where rounding shows in the joint positions."""
OUT_OF_REACH = 2
_new: Any = tuple.__new__  # makes a named tuple in a third of the time that its class takes
_A3 = cython.declare(cython.Py_ssize_t, 2)
_OPW = cython.declare(cython.int, 1)
_REGULAR = cython.declare(cython.int, 0)
_NEAR = cython.declare(cython.int, 1)
_OUT_OF_REACH = cython.declare(cython.int, 2)

_PI = cython.declare(cython.double, 3.141592653589793)
_TAU = cython.declare(cython.double, 6.283185307179586)
# Square of the wrist point's distance (m^2) from the axis of A1 where it is on it, and A1 is free.
_ON_AXIS = cython.declare(cython.double, 4e-20)
# Square of that distance, and of the wrist point's x in the frame of A1, below which rounding shows.
_NEAR_AXIS = cython.declare(cython.double, 1e-10)
# Below this sine of the middle wrist joint rounding shows in the others by more than 1e-8 rad.
_NEARLY_ALIGNED = cython.declare(cython.double, 2e-8)
# Square of the sine of half the bend of the elbow: nearly straight (3e-5 rad), and straight.
_NEAR_STRAIGHT = cython.declare(cython.double, 2.5e-10)
_STRAIGHT = cython.declare(cython.double, 2.5e-15)
# Farther than this out of reach (m, or in that square) is out of reach; closer is rounding.
_REACH = cython.declare(cython.double, 1e-9)


@cython.cclass
class Tcp:
    """A frame fixed to the flange. Joint positions are rad, base first; poses are in the base, in m.

    It caches the last joint positions: several callers ask for the same ones in a tick.
    """

    def __init__(self, fixed: Sequence[Transform], tool_in_flange: Transform) -> None:
        """`fixed` are poses at zero of each joint in the one before it, and of the flange in the last joint.

        Each joint turns about z of its own frame; the first pose is in the base."""
        self.tool_in_flange = tool_in_flange
        self.joint_count = count = len(fixed) - 1
        rows = [*fixed[:count], compose(fixed[count], tool_in_flange)]
        self.fixed = np.array([(*rotation, *translation) for rotation, translation in rows])
        self._fixed = self.fixed
        self._q = np.full(count, np.nan)  # different from any
        self.turned, self.place = np.empty(9), np.empty(3)
        self.sides, self.axes, self.points = np.empty((3, count, 3))
        self._columns_array = self.columns = np.empty((6, count))
        self.torque = np.empty(count)
        self._has_columns = False
        self._pose: Any = None

    def longest_levers(self) -> tuple[float, ...]:
        """Return for each joint the largest possible distance (m) between its axis and the TCP."""
        lengths = [hypot(*row[9:]) for row in self.fixed.tolist()]
        return tuple([sum(lengths[joint:]) for joint in range(1, len(lengths))])

    def pose(self, joints: Sequence[float]) -> Transform:
        """Return the pose of the TCP."""
        if not self.go_to(joints) or self._pose is None:
            r, p = self.turned, self.place
            rotation = (r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8])
            self._pose = _new(Transform, (rotation, (p[0], p[1], p[2])))
        pose: Transform = self._pose
        return pose

    def jacobian(self, joints: Sequence[float]) -> NDArray[np.float64]:
        """Return the Jacobian (6, n): velocity (m/s), then angular velocity (rad/s), in base axes."""
        self.go_to(joints)
        self.find_columns()
        return self._columns_array.copy()

    def torques(self, joints: Sequence[float], wrench: Sequence[float]) -> tuple[float, ...]:
        """Return the joint torques (Nm) of a wrench (N, Nm) at the TCP along its axes."""
        self.find_torques(joints, wrench)
        return tuple([self.torque[k] for k in range(self.joint_count)])

    @cython.cfunc
    def find_torques(self, joints: Any, wrench: Any) -> object:
        """Compute `torques`."""
        w = cython.declare(cython.double[6])
        f = cython.declare(cython.double[6])  # in base axes
        for k in range(6):
            w[k] = wrench[k]
        self.go_to(joints)
        self.find_columns()
        r, j = self.turned, self.columns
        for k in range(3):
            f[k] = r[3 * k] * w[0] + r[3 * k + 1] * w[1] + r[3 * k + 2] * w[2]
            f[3 + k] = r[3 * k] * w[3] + r[3 * k + 1] * w[4] + r[3 * k + 2] * w[5]
        for k in range(self.joint_count):
            force = j[0, k] * f[0] + j[1, k] * f[1] + j[2, k] * f[2]
            self.torque[k] = force + (j[3, k] * f[3] + j[4, k] * f[4] + j[5, k] * f[5])
        return None

    @cython.cfunc
    @cython.exceptval(-1)
    def go_to(self, joints: Any) -> cython.bint:
        """Compute the pose for joint positions (rad); return whether it was cached."""
        if len(joints) != self.joint_count:
            raise ValueError(f"{len(joints)} joint positions, expected {self.joint_count}")
        same: cython.bint = True
        q: cython.double
        for k in range(self.joint_count):
            q = joints[k]
            if q != self._q[k]:
                self._q[k] = q
                same = False
        if same:
            return True
        self._has_columns = False
        self._pose = None
        f = self._fixed
        r = cython.declare(cython.double[9])  # the compiler keeps these in registers, unlike arrays
        p = cython.declare(cython.double[3])
        for i in range(9):
            r[i] = 1.0 if i % 4 == 0 else 0.0
        p[0] = p[1] = p[2] = 0.0
        s: cython.double = 0.0
        c: cython.double = 1.0
        for k in range(self.joint_count + 1):
            if k < self.joint_count:
                s, c = sin(self._q[k]), cos(self._q[k])
            else:  # the TCP, which does not turn
                s, c = 0.0, 1.0
            for i in range(3):
                x, y, z = r[3 * i], r[3 * i + 1], r[3 * i + 2]
                p[i] += x * f[k, 9] + y * f[k, 10] + z * f[k, 11]
                a = x * f[k, 0] + y * f[k, 3] + z * f[k, 6]
                b = x * f[k, 1] + y * f[k, 4] + z * f[k, 7]
                r[3 * i], r[3 * i + 1] = c * a + s * b, c * b - s * a
                r[3 * i + 2] = x * f[k, 2] + y * f[k, 5] + z * f[k, 8]
                if k < self.joint_count:
                    self.points[k, i], self.sides[k, i], self.axes[k, i] = p[i], r[3 * i], r[3 * i + 2]
        for i in range(9):
            self.turned[i] = r[i]
        for i in range(3):
            self.place[i] = p[i]
        return False

    @cython.cfunc
    @cython.exceptval(check=False)
    def find_columns(self) -> cython.void:
        """Compute the Jacobian for the cached joint positions."""
        if self._has_columns:
            return
        self._has_columns = True
        j, a, p = self.columns, self.axes, self.points
        for k in range(self.joint_count):
            x, y, z = self.place[0] - p[k, 0], self.place[1] - p[k, 1], self.place[2] - p[k, 2]
            j[0, k] = a[k, 1] * z - a[k, 2] * y
            j[1, k] = a[k, 2] * x - a[k, 0] * z
            j[2, k] = a[k, 0] * y - a[k, 1] * x
            j[3, k], j[4, k], j[5, k] = a[k, 0], a[k, 1], a[k, 2]


@cython.cfunc
@cython.exceptval(check=False)
def _turned_to(
    c: cython.double, s: cython.double, free: cython.double, least: cython.double
) -> tuple[cython.double, cython.double, cython.double]:
    """Return cosine and sine of the direction of (c, s), and its angle.

    It is the angle `free` for a square of the length up to `least`.
    """
    square: cython.double = c * c + s * s
    if square <= least:
        return cos(free), sin(free), free
    length: cython.double = sqrt(square)
    return c / length, s / length, atan2(s, c)


@cython.cfunc
@cython.exceptval(check=False)
def _solve_srs(
    numbers: cython.double[::1],
    poses: cython.double[:, ::1],
    row: cython.Py_ssize_t,
    redundancy: cython.double,
    status: cython.int,
    seed: cython.double[::1],
    aligned: cython.double,
    joints: cython.double[:, ::1],
) -> cython.int:
    """Solve for an S-R-S arm with given A3.

    The distance of the wrist point from the shoulder gives A4. In the frame that A1 and A2 turn the wrist
    point is v = (-d5 sinA4 cosA3, -d5 sinA4 sinA3, d3 + d5 cosA4). Turned by A2 it has the height of the
    wrist point, turned by A1 its direction. A Z-Y-Z wrist makes the rest of the orientation.
    """
    d3, d5, d7 = numbers[1], numbers[2], numbers[3]
    r00, r01, r02 = poses[row, 0], poses[row, 1], poses[row, 2]
    r10, r11, r12 = poses[row, 3], poses[row, 4], poses[row, 5]
    r20, r21, r22 = poses[row, 6], poses[row, 7], poses[row, 8]
    result = _REGULAR
    wx = poses[row, 9] - d7 * r02
    wy = poses[row, 10] - d7 * r12
    wz = poses[row, 11] - d7 * r22 - numbers[0]
    h2 = wx * wx + wy * wy

    # A4 from the half angle, which keeps its digits near the straight arm
    half2 = ((d3 + d5) * (d3 + d5) - h2 - wz * wz) * (0.25 / (d3 * d5))
    if not -_REACH <= half2 <= 1.0:
        return _OUT_OF_REACH
    s3, c3 = sin(redundancy), cos(redundancy)
    s4 = 2.0 * sqrt(half2 * (1.0 - half2)) if half2 > 0.0 else 0.0
    vy = d5 * s4 * s3
    x2 = h2 - vy * vy
    if half2 < _NEAR_STRAIGHT or x2 < _NEAR_AXIS:
        result = _NEAR
        if half2 < _STRAIGHT:
            half2 = 0.0
            x2 = h2
        elif x2 < 0.0:
            # The forearm sticks out sideways farther than the wrist point is from the axis of A1. It is
            # rounding if a straighter arm of the same length would do, or if it is too little.
            straighter = half2 * h2 / (vy * vy)
            if half2 - straighter < _REACH:
                half2 = straighter
            elif sqrt(vy * vy) - sqrt(h2) >= _REACH:
                return _OUT_OF_REACH
            x2 = 0.0
        s4 = 2.0 * sqrt(half2 * (1.0 - half2))
    c4 = 1.0 - 2.0 * half2
    if status & 2:
        s4 = -s4
    vx = -d5 * s4 * c3
    vy = -d5 * s4 * s3
    vz = d3 + d5 * c4
    x1 = -sqrt(x2) if status & 1 else sqrt(x2)

    # A2 turns (vx, vz) to (x1, wz), A1 turns (x1, vy) to (wx, wy)
    c2 = x1 * vx + wz * vz
    s2 = x1 * vz - wz * vx
    c2, s2, q2 = _turned_to(c2, s2, seed[1], 1e-40)  # free if the forearm is along y
    c1, s1 = wx * x1 + wy * vy, wy * x1 - wx * vy
    c1, s1, q1 = _turned_to(c1, s1, seed[0], _ON_AXIS * h2)

    # direction of A7 in the frame that A1 to A4 turn, by turning it back joint by joint
    y = c1 * r12 - s1 * r02
    z = c1 * r02 + s1 * r12
    x = c2 * z - s2 * r22
    z = c2 * r22 + s2 * z
    t1 = c3 * y - s3 * x
    x = c3 * x + s3 * y
    t0 = c4 * x + s4 * z
    t2 = c4 * z - s4 * x
    side: cython.double = -1.0 if status & 4 else 1.0
    c5, s5, q5 = _turned_to(side * t0, side * t1, seed[4], aligned * aligned)
    s6 = c5 * t0 + s5 * t1
    if aligned < fabs(s6) < _NEARLY_ALIGNED:
        result = _NEAR
    s6 = side * max(side * s6, 0.0)
    # axis of A6 in the base, joint by joint: seen from there A7 has turned the flange's x and y
    x = -s5 * c4
    z = -s5 * s4
    y = s3 * x + c3 * c5
    x = c3 * x - s3 * c5
    x, z = c2 * x + s2 * z, c2 * z - s2 * x
    x, y = c1 * x - s1 * y, s1 * x + c1 * y
    joints[row, 0] = _half_open(q1)
    joints[row, 1] = _half_open(q2)
    joints[row, 2] = redundancy
    joints[row, 3] = _half_open(atan2(s4, c4))
    joints[row, 4] = _half_open(q5)
    joints[row, 5] = _half_open(atan2(s6, t2))
    joints[row, 6] = _half_open(atan2(x * r00 + y * r10 + z * r20, x * r01 + y * r11 + z * r21))
    return result


@cython.cfunc
@cython.exceptval(check=False)
def _solve_opw(
    numbers: cython.double[::1],
    poses: cython.double[:, ::1],
    row: cython.Py_ssize_t,
    status: cython.int,
    seed: cython.double[::1],
    aligned: cython.double,
    joints: cython.double[:, ::1],
) -> cython.int:
    """Solve for a six-joint arm with a spherical wrist (Brandstoetter, Angerer and Hofbaur 2014).

    A1 turns the plane of the arm to the wrist point, or away from it. In that plane upper arm and forearm
    make a triangle. An X-Y-X wrist makes the rest of the orientation.
    """
    o = numbers
    ux, uz, hand, k = o[2], o[3], o[4], o[5]
    # the rotation, corrected to be the identity at zero pose
    a, b, c = poses[row, 0], poses[row, 1], poses[row, 2]
    r00, r01 = a * o[16] + b * o[19] + c * o[22], a * o[17] + b * o[20] + c * o[23]
    r02 = a * o[18] + b * o[21] + c * o[24]
    a, b, c = poses[row, 3], poses[row, 4], poses[row, 5]
    r10, r11 = a * o[16] + b * o[19] + c * o[22], a * o[17] + b * o[20] + c * o[23]
    r12 = a * o[18] + b * o[21] + c * o[24]
    a, b, c = poses[row, 6], poses[row, 7], poses[row, 8]
    r20, r21 = a * o[16] + b * o[19] + c * o[22], a * o[17] + b * o[20] + c * o[23]
    r22 = a * o[18] + b * o[21] + c * o[24]
    result = _REGULAR
    wx = poses[row, 9] - hand * r00
    wy = poses[row, 10] - hand * r10
    tz = poses[row, 11] - hand * r20 - o[1]
    h2 = wx * wx + wy * wy
    x1 = -sqrt(h2) if status & 1 else sqrt(h2)
    tx = x1 - o[0]

    # bend of the elbow from the half angle, which keeps its digits near the straight arm
    half2 = (o[6] - tx * tx - tz * tz) * o[7]
    if not -_REACH <= half2 <= 1.0:
        return _OUT_OF_REACH
    if half2 < _NEAR_STRAIGHT or h2 < _NEAR_AXIS:
        result = _NEAR
        half2 = max(half2, 0.0)
    sd = 2.0 * sqrt(half2 * (1.0 - half2))
    cd = 1.0 - 2.0 * half2
    if (o[12] < 0.0) == ((status & 2) != 0):
        sd = -sd

    c1, s1, q1 = _turned_to(wx * x1, wy * x1, o[10] * seed[0], _ON_AXIS * h2)
    # A2 turns (vx, vz), from shoulder to wrist, to (tx, tz)
    vx = ux + k * (ux * cd + uz * sd)
    vz = uz + k * (uz * cd - ux * sd)
    c2 = tx * vx + tz * vz
    s2 = tx * vz - tz * vx
    c2, s2, q2 = _turned_to(c2, s2, o[11] * seed[1], 1e-40)  # free if the wrist point is in the shoulder
    s3 = sd * o[9] + cd * o[8]
    c3 = cd * o[9] - sd * o[8]
    s23 = s2 * c3 + c2 * s3
    c23 = c2 * c3 - s2 * s3

    # direction of A6 in the frame that A1 to A3 turn
    x = c1 * r00 + s1 * r10
    y = c1 * r10 - s1 * r00
    t0 = x * c23 - r20 * s23
    z = x * s23 + r20 * c23
    side: cython.double = 1.0 if ((status & 4) != 0) == (o[14] > 0.0) else -1.0
    c4, s4, q4 = _turned_to(-side * z, side * y, o[13] * seed[3], aligned * aligned)
    s5 = s4 * y - c4 * z
    if aligned < fabs(s5) < _NEARLY_ALIGNED:
        result = _NEAR
    s5 = side * max(side * s5, 0.0)
    # axis of A5 in the base: seen from there A6 has turned the flange's y and z
    z = s4 * c23
    x = c1 * (s4 * s23) - s1 * c4
    y = s1 * (s4 * s23) + c1 * c4
    joints[row, 0] = _half_open(o[10] * q1)
    joints[row, 1] = _half_open(o[11] * q2)
    joints[row, 2] = _half_open(o[12] * atan2(s3, c3))
    joints[row, 3] = _half_open(o[13] * q4)
    joints[row, 4] = _half_open(o[14] * atan2(s5, t0))
    x, y = -(x * r02 + y * r12 + z * r22), x * r01 + y * r11 + z * r21
    joints[row, 5] = _half_open(o[15] * atan2(x, y))
    return result


@cython.ccall
@cython.exceptval(check=False)
def branch(
    kind: cython.int,
    numbers: cython.double[::1],
    q: cython.double[::1],
    distances: cython.double[::1],
) -> cython.int:
    """Return the status of joint positions (rad).

    `distances` (3,) becomes their distances from the places where the branches of each bit meet: the wrist
    point's x (m) in the frame that A1 turns, the bend of the elbow and the middle joint of the wrist (rad).
    """
    o = numbers
    if kind == _OPW:
        q2 = o[11] * q[1]
        q23 = q2 + o[12] * q[2]
        distances[0] = o[0] + o[2] * cos(q2) + o[3] * sin(q2) + o[25] * cos(q23) + o[26] * sin(q23)
        distances[1] = remainder(q[2] - o[27], _TAU)
        distances[2] = q[4]
        return (distances[0] < 0.0) | (distances[1] >= 0.0) << 1 | (distances[2] > 0.0) << 2
    reach = sin(q[1]) * (o[1] + o[2] * cos(q[3]))
    distances[0] = reach - cos(q[1]) * o[2] * sin(q[3]) * cos(q[2])
    distances[1] = q[3]
    distances[2] = q[5]
    return (distances[0] < 0.0) | (distances[1] < 0.0) << 1 | (distances[2] <= 0.0) << 2


@cython.ccall
@cython.exceptval(check=False)
def solve(
    kind: cython.int,
    numbers: cython.double[::1],
    poses: cython.double[:, ::1],
    redundancies: cython.double[::1],
    statuses: cython.longlong[::1],
    seed: cython.double[::1],
    aligned: cython.double,
    joints: cython.double[:, ::1],
    results: cython.longlong[::1],
) -> cython.void:
    """Write the joint positions of one branch for each pose of the flange, and how it went.

    Args:
        kind: SRS or OPW.
        numbers: Dimensions of the arm, see `iiwa_sim.robot.inverse`.
        poses: Poses of the flange in the base (m, 12).
        redundancies: Positions of A3 (m,); an arm without redundancy ignores them.
        statuses: The branches (m,).
        seed: Joint positions (n,) from which joints are taken that are free at a singular pose.
        aligned: Sine of the middle wrist joint up to which the joint before it is free.
        joints: Joint positions (m, n) above -pi and up to pi.
        results: REGULAR, NEAR a singular pose, or OUT_OF_REACH (m,).
    """
    for row in range(poses.shape[0]):
        status: cython.int = statuses[row]
        if kind == _OPW:
            results[row] = _solve_opw(numbers, poses, row, status, seed, aligned, joints)
        else:
            results[row] = _solve_srs(numbers, poses, row, redundancies[row], status, seed, aligned, joints)


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _half_open(angle: cython.double) -> cython.double:
    """Return an angle (rad) of less than a turn, above -pi and up to pi."""
    if angle > _PI:
        return angle - _TAU
    return angle + _TAU if angle <= -_PI else angle


def continued(joints: Sequence[float], before: Sequence[float]) -> tuple[float, ...]:
    """Return joint positions, moved by whole turns to be nearest to those before, beyond any limits."""
    position: cython.double
    there: cython.double
    turned = []
    for position, there in zip(joints, before, strict=True):
        turned.append(position + _TAU * floor((there - position) / _TAU + 0.5))
    return tuple(turned)


@cython.cclass
class Kinematics:
    """Forward and inverse kinematics of the TCP of one robot with one tool; redundancy is a coordinate."""

    def __init__(self, model: Any, inverse_kinematics: Any, tool_in_flange: Transform) -> None:
        """Set model (`iiwa_sim.robot.model.Model`), inverse (`iiwa_sim.robot.inverse.Inverse`) and tool."""
        self.arm = model.tcp(tool_in_flange)
        self.joint_count = model.joint_count
        self._inverse: Any = inverse_kinematics
        self._kind, self._numbers = inverse_kinematics.kind, inverse_kinematics.numbers
        self.coordinates = 7 if self._kind == SRS else 6
        rotation, place = inverse(tool_in_flange)
        self._to_flange = np.array((*rotation, *place))
        d = model.description
        self._beyond_half_turn = min(d.position_min) < -pi or max(d.position_max) > pi
        self._pose, self._joints = np.zeros((1, 12)), np.zeros((1, self.joint_count))
        self._seed, self._distances = np.zeros(self.joint_count), np.zeros(3)
        self._redundancy, (self._branch, self._result) = np.zeros(1), np.zeros((2, 1), dtype=np.int64)
        self._last: Any = None

    def redundancy(self, q: Sequence[float]) -> float:
        """Return the redundancy of joint positions."""
        return q[_A3] if self.coordinates == 7 else 0.0

    def tcp_and_jacobian(self, q: Sequence[float]) -> tuple[Transform, NDArray[np.float64]]:
        """Return the pose of the TCP and its Jacobian (m/s, rad/s, base axes), the redundancy's row last."""
        jacobian = self.arm.jacobian(q)
        if self.coordinates == 7:
            jacobian = np.concatenate([jacobian, np.eye(self.joint_count)[[_A3]]])
        return self.arm.pose(q), jacobian

    @cython.cfunc
    def joints_for(
        self,
        turned: cython.double[::1],
        x: cython.double,
        y: cython.double,
        z: cython.double,
        redundancy: cython.double,
        present: Any,
    ) -> Any:
        """Return joint positions on the present branch for rotation (row by row) and position of the TCP.

        Joints with more than one turn take the one nearest to the present position. None if out of reach.
        """
        p, t, r, q = self._pose, self._to_flange, turned, self._seed
        for i in range(3):
            a, b, c = r[3 * i], r[3 * i + 1], r[3 * i + 2]
            for k in range(3):
                p[0, 3 * i + k] = a * t[k] + b * t[3 + k] + c * t[6 + k]
            p[0, 9 + i] = a * t[9] + b * t[10] + c * t[11]
        p[0, 9] += x
        p[0, 10] += y
        p[0, 11] += z
        for k in range(self.joint_count):
            q[k] = present[k]
        if present is not self._last:
            self._branch[0] = branch(self._kind, self._numbers, q, self._distances)
        self._redundancy[0] = redundancy
        solve(
            self._kind, self._numbers, p, self._redundancy, self._branch, q, 0.0, self._joints, self._result
        )
        result = self._result[0]
        if result == _OUT_OF_REACH:
            return None
        joints: Any = tuple([self._joints[0, k] for k in range(self.joint_count)])
        if result == _NEAR:
            numbers = [p[0, k] for k in range(12)]
            flange = Transform(tuple(numbers[:9]), tuple(numbers[9:]))
            joints = self._inverse.joints(flange, redundancy, int(self._branch[0]), present)
            if joints is None:
                return None
        if self._beyond_half_turn:
            joints = continued(joints, present)
        self._last = joints if result == _REGULAR else None  # this position is on the branch as well
        return joints


@cython.ccall
def carried_wrench(
    now: Transform,
    motion: tuple[Transform, Transform, Transform] | None,
    tick_s: cython.double,
    moments: cython.double[:, :],
) -> Wrench:
    """Return the wrench of weight and inertia of a body that is fixed to the TCP, along the axes of the TCP.

    `motion` are three consecutive poses, with the second derivatives at the middle one, None for rest;
    `moments` are in the TCP.
    """
    r: tuple[float, ...] = now[0]
    gx: cython.double = r[6]
    gy: cython.double = r[7]
    gz: cython.double = r[8]
    gx, gy, gz = -9.81 * gx, -9.81 * gy, -9.81 * gz
    x: cython.double = moments[3, 0]
    y: cython.double = moments[3, 1]
    z: cython.double = moments[3, 2]
    fx, fy, fz = moments[3, 3] * gx, moments[3, 3] * gy, moments[3, 3] * gz
    tx, ty, tz = y * gz - z * gy, z * gx - x * gz, x * gy - y * gx
    if motion is None:
        return (fx, fy, fz, tx, ty, tz)
    m = cython.declare(cython.double[9])
    d = cython.declare(cython.double[12])  # second differences of the rows of [R p]
    p = cython.declare(cython.double[12])  # R^T [R'' p''] times the moments
    a: cython.double
    b: cython.double
    c: cython.double
    first: tuple[float, ...] = motion[0][0]
    middle: tuple[float, ...] = motion[1][0]
    last: tuple[float, ...] = motion[2][0]
    for k in range(9):
        a, b, c = first[k], middle[k], last[k]
        m[k] = b
        d[4 * (k // 3) + k % 3] = (c - b) - (b - a)
    first, middle, last = motion[0][1], motion[1][1], motion[2][1]
    for k in range(3):
        a, b, c = first[k], middle[k], last[k]
        d[4 * k + 3] = (c - b) - (b - a)
    for i in range(3):
        for j in range(4):
            a = 0.0
            for k in range(4):
                b = m[i] * d[k] + m[3 + i] * d[4 + k] + m[6 + i] * d[8 + k]
                a += b * moments[k, j]
            p[4 * i + j] = a / (tick_s * tick_s)
    return (
        fx - p[3], fy - p[7], fz - p[11], tx - (p[9] - p[6]), ty - (p[2] - p[8]), tz - (p[4] - p[1])
    )  # fmt: skip
