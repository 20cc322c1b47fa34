"""The closed form of `iiwa_sim.robot.opw`, without the iteration near singular poses."""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc.math import remainder, sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.arctangent_kernel import arctangent
    from cython.cimports.iiwa_sim.robot.trigonometry_kernel import cosine, sine
else:
    from iiwa_sim.robot.arctangent_kernel import arctangent
    from iiwa_sim.robot.trigonometry_kernel import cosine, sine

_REGULAR = cython.declare(cython.int, 0)
_NEAR = cython.declare(cython.int, 1)
_OUT_OF_REACH = cython.declare(cython.int, 2)

# Squares of the wrist point's distance (m^2) from the axis of A1 where it is on it, and A1 is free, and where
# rounding shows in A1.
_ON_AXIS = cython.declare(cython.double, 4e-20)
_NEAR_AXIS = cython.declare(cython.double, 1e-10)
# Below this sine of A5 rounding shows in A4 by more than 1e-8 rad.
_NEARLY_ALIGNED = cython.declare(cython.double, 2e-8)
# Below this square of the sine of half the bend of the elbow the arm is nearly straight (3e-5 rad).
_NEAR_STRAIGHT = cython.declare(cython.double, 2.5e-10)
# Farther than this out of reach, in that square, is out of reach; closer is rounding.
_REACH = cython.declare(cython.double, 1e-10)


@cython.ccall
@cython.exceptval(check=False)
def solve(
    numbers: cython.double[::1],
    poses: cython.double[:, ::1],
    row: cython.Py_ssize_t,
    redundancy: cython.double,  # noqa: ARG001  an arm without
    status: cython.int,
    seed: cython.double[::1],
    aligned: cython.double,
    joints: cython.double[:, ::1],
) -> cython.int:
    """Joint positions (rad, above -pi, up to pi) on a branch, into that row of `joints`.

    `numbers` are those of `iiwa_sim.robot.opw.opw`. A row of `poses` is a pose of the flange in the base:
    nine numbers of its rotation, row by row, and its place (m). With a sine of A5 of at most `aligned` A4
    is that of the seed.
    Returns whether that is regular, near a singular pose, where rounding shows, or out of reach.
    """
    sx: cython.double = numbers[0]
    ux: cython.double = numbers[2]
    uz: cython.double = numbers[3]
    hand: cython.double = numbers[4]
    k: cython.double = numbers[5]
    sp: cython.double = numbers[8]
    cp: cython.double = numbers[9]
    # the rotation, corrected to be the identity at zero pose
    a, b, c = poses[row, 0], poses[row, 1], poses[row, 2]
    r00: cython.double = a * numbers[16] + b * numbers[19] + c * numbers[22]
    r01: cython.double = a * numbers[17] + b * numbers[20] + c * numbers[23]
    r02: cython.double = a * numbers[18] + b * numbers[21] + c * numbers[24]
    a, b, c = poses[row, 3], poses[row, 4], poses[row, 5]
    r10: cython.double = a * numbers[16] + b * numbers[19] + c * numbers[22]
    r11: cython.double = a * numbers[17] + b * numbers[20] + c * numbers[23]
    r12: cython.double = a * numbers[18] + b * numbers[21] + c * numbers[24]
    a, b, c = poses[row, 6], poses[row, 7], poses[row, 8]
    r20: cython.double = a * numbers[16] + b * numbers[19] + c * numbers[22]
    r21: cython.double = a * numbers[17] + b * numbers[20] + c * numbers[23]
    r22: cython.double = a * numbers[18] + b * numbers[21] + c * numbers[24]
    result: cython.int = _REGULAR
    wx: cython.double = poses[row, 9] - hand * r00
    wy: cython.double = poses[row, 10] - hand * r10
    tz: cython.double = poses[row, 11] - hand * r20 - numbers[1]
    h2: cython.double = wx * wx + wy * wy
    x1: cython.double = -sqrt(h2) if status & 1 else sqrt(h2)
    tx: cython.double = x1 - sx

    # bend of the elbow from the half angle, which keeps its digits near the straight arm
    half2: cython.double = (numbers[6] - tx * tx - tz * tz) * numbers[7]
    if not -_REACH <= half2 <= 1.0:
        return _OUT_OF_REACH
    if half2 < _NEAR_STRAIGHT or h2 < _NEAR_AXIS:
        result = _NEAR
        if half2 < 0.0:
            half2 = 0.0
    sd: cython.double = 2.0 * sqrt(half2 * (1.0 - half2))
    cd: cython.double = 1.0 - 2.0 * half2
    if (numbers[12] < 0.0) == ((status & 2) != 0):
        sd = -sd

    if h2 > _ON_AXIS:
        c1 = wx / x1
        s1 = wy / x1
        q1 = arctangent(s1, c1)
    else:
        q1 = numbers[10] * seed[0]
        c1 = cosine(q1)
        s1 = sine(q1)
    # A2 turns (vx, vz), from shoulder to wrist, to (tx, tz)
    vx: cython.double = ux + k * (ux * cd + uz * sd)
    vz: cython.double = uz + k * (uz * cd - ux * sd)
    c2: cython.double = tx * vx + tz * vz
    s2: cython.double = tx * vz - tz * vx
    n: cython.double = sqrt(c2 * c2 + s2 * s2)
    if n > 1e-20:
        c2 /= n
        s2 /= n
        q2 = arctangent(s2, c2)
    else:  # wrist point in the shoulder
        q2 = numbers[11] * seed[1]
        c2 = cosine(q2)
        s2 = sine(q2)
    s3: cython.double = sd * cp + cd * sp
    c3: cython.double = cd * cp - sd * sp
    s23: cython.double = s2 * c3 + c2 * s3
    c23: cython.double = c2 * c3 - s2 * s3

    # direction of A6 in the frame that A1 to A3 turn
    x: cython.double = c1 * r00 + s1 * r10
    y: cython.double = c1 * r10 - s1 * r00
    t0: cython.double = x * c23 - r20 * s23
    z: cython.double = x * s23 + r20 * c23
    s5: cython.double = sqrt(y * y + z * z)
    above: cython.bint = ((status & 4) != 0) == (numbers[14] > 0.0)
    if s5 > aligned:
        if s5 < _NEARLY_ALIGNED:
            result = _NEAR
        if not above:
            s5 = -s5
        s4 = y / s5
        c4 = -z / s5
        q4 = arctangent(s4, c4)
    else:
        q4 = numbers[13] * seed[3]
        s4 = sine(q4)
        c4 = cosine(q4)
        s5 = s4 * y - c4 * z
        if (s5 < 0.0) == above:
            s5 = 0.0
    # axis of A5 in the base: seen from there A6 has turned the flange's y and z
    z = s4 * c23
    x = c1 * (s4 * s23) - s1 * c4
    y = s1 * (s4 * s23) + c1 * c4
    joints[row, 0] = _half_open(numbers[10] * q1)
    joints[row, 1] = _half_open(numbers[11] * q2)
    joints[row, 2] = _half_open(numbers[12] * arctangent(s3, c3))
    joints[row, 3] = _half_open(numbers[13] * q4)
    joints[row, 4] = _half_open(numbers[14] * arctangent(s5, t0))
    joints[row, 5] = _half_open(
        numbers[15] * arctangent(-(x * r02 + y * r12 + z * r22), x * r01 + y * r11 + z * r21)
    )
    return result


@cython.ccall
@cython.exceptval(check=False)
def branch(numbers: cython.double[::1], q: cython.double[::1], distances: cython.double[::1]) -> cython.int:
    """The status of joint positions (rad), and the distances (3,) from where the branches of each of its bits
    meet: of the wrist point in x (m) of the frame that A1 turns, of A3 from where the arm is stretched, and
    of A5 (rad)."""
    q2: cython.double = numbers[11] * q[1]
    q23: cython.double = q2 + numbers[12] * q[2]
    upper: cython.double = numbers[0] + numbers[2] * cosine(q2) + numbers[3] * sine(q2)
    distances[0] = upper + numbers[25] * cosine(q23) + numbers[26] * sine(q23)
    distances[1] = remainder(q[2] - numbers[27], 6.283185307179586)
    distances[2] = q[4]
    return (distances[0] < 0.0) | (distances[1] >= 0.0) << 1 | (distances[2] > 0.0) << 2


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _half_open(angle: cython.double) -> cython.double:
    """An angle (rad) of less than a turn, above -pi and up to pi."""
    if angle > 3.141592653589793:
        return angle - 6.283185307179586
    return angle + 6.283185307179586 if angle <= -3.141592653589793 else angle
