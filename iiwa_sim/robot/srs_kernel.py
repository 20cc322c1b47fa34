"""The closed form of `iiwa_sim.robot.srs`, without the iteration near singular poses."""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc.math import sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.arctangent_kernel import arctangent
    from cython.cimports.iiwa_sim.robot.trigonometry_kernel import cosine, sine
else:
    from iiwa_sim.robot.arctangent_kernel import arctangent
    from iiwa_sim.robot.trigonometry_kernel import cosine, sine

_REGULAR = cython.declare(cython.int, 0)
_NEAR = cython.declare(cython.int, 1)
_OUT_OF_REACH = cython.declare(cython.int, 2)

# Square of the wrist point's distance (m^2) from the axis of A1 where it is on it, and A1 is free.
_ON_AXIS = cython.declare(cython.double, 4e-20)
# Below this sine of A6 rounding shows in A5 by more than 1e-8 rad.
_NEARLY_ALIGNED = cython.declare(cython.double, 2e-8)
# Below this sin^2(A4 / 2) the arm is nearly straight (A4 of 3e-5 rad); and where it is straight.
_NEAR_STRAIGHT = cython.declare(cython.double, 2.5e-10)
_STRAIGHT = cython.declare(cython.double, 2.5e-15)
# Below this square of the wrist point's x (m^2) in the frame of A1 the two solutions for A2 nearly meet.
_NEAR_FOLD = cython.declare(cython.double, 1e-10)
# Farther than this out of reach (m, or in sin^2(A4 / 2)) is out of reach; closer is rounding.
_REACH = cython.declare(cython.double, 1e-10)


@cython.ccall
@cython.exceptval(check=False)
def solve(
    numbers: cython.double[::1],
    poses: cython.double[:, ::1],
    row: cython.Py_ssize_t,
    redundancy: cython.double,
    status: cython.int,
    seed: cython.double[::1],
    aligned: cython.double,
    joints: cython.double[:, ::1],
) -> cython.int:
    """Joint positions (rad, above -pi, up to pi) on a branch into that row of `joints`.

    `numbers` are the four lengths (m). A row of `poses` is a pose of the flange in the base: nine numbers
    of its rotation, row by row, and its place (m). With a sine of A6 of at most `aligned` A5 is
    that of the seed.
    Returns whether that is regular, near a singular pose, where rounding shows, or out of reach.
    """
    d3: cython.double = numbers[1]
    d5: cython.double = numbers[2]
    d7: cython.double = numbers[3]
    r00: cython.double = poses[row, 0]
    r01: cython.double = poses[row, 1]
    r02: cython.double = poses[row, 2]
    r10: cython.double = poses[row, 3]
    r11: cython.double = poses[row, 4]
    r12: cython.double = poses[row, 5]
    r20: cython.double = poses[row, 6]
    r21: cython.double = poses[row, 7]
    r22: cython.double = poses[row, 8]
    result: cython.int = _REGULAR
    wx: cython.double = poses[row, 9] - d7 * r02
    wy: cython.double = poses[row, 10] - d7 * r12
    wz: cython.double = poses[row, 11] - d7 * r22 - numbers[0]
    h2: cython.double = wx * wx + wy * wy

    # A4 from the half angle, which keeps its digits near the straight arm
    half2: cython.double = ((d3 + d5) * (d3 + d5) - h2 - wz * wz) * (0.25 / (d3 * d5))
    if not -_REACH <= half2 <= 1.0:
        return _OUT_OF_REACH
    s3: cython.double = sine(redundancy)
    c3: cython.double = cosine(redundancy)
    s4: cython.double = 2.0 * sqrt(half2 * (1.0 - half2)) if half2 > 0.0 else 0.0
    vy: cython.double = d5 * s4 * s3
    x2: cython.double = h2 - vy * vy
    if half2 < _NEAR_STRAIGHT or x2 < _NEAR_FOLD:
        result = _NEAR
        if half2 < _STRAIGHT:
            half2 = 0.0
            x2 = h2
        elif x2 < 0.0:
            # The forearm sticks out sideways farther than the wrist point is from the axis of A1. That is
            # rounding where a straighter arm of the same length would do, or where it is too little.
            straighter = half2 * h2 / (vy * vy)
            if half2 - straighter < _REACH:
                half2 = straighter
            elif sqrt(vy * vy) - sqrt(h2) >= _REACH:
                return _OUT_OF_REACH
            x2 = 0.0
        s4 = 2.0 * sqrt(half2 * (1.0 - half2))
    c4: cython.double = 1.0 - 2.0 * half2
    if status & 2:
        s4 = -s4
    vx: cython.double = -d5 * s4 * c3
    vy = -d5 * s4 * s3
    vz: cython.double = d3 + d5 * c4
    x1: cython.double = -sqrt(x2) if status & 1 else sqrt(x2)

    # A2 turns (vx, vz) to (x1, wz), A1 turns (x1, vy) to (wx, wy)
    c2: cython.double = x1 * vx + wz * vz
    s2: cython.double = x1 * vz - wz * vx
    n: cython.double = sqrt(c2 * c2 + s2 * s2)
    if n > 1e-20:
        c2 /= n
        s2 /= n
        q2 = arctangent(s2, c2)
    else:  # forearm along y
        q2 = seed[1]
        c2 = cosine(q2)
        s2 = sine(q2)
    if h2 > _ON_AXIS:
        c1 = wx * x1 + wy * vy
        s1 = wy * x1 - wx * vy
        n = sqrt(c1 * c1 + s1 * s1)
        c1 /= n
        s1 /= n
        q1 = arctangent(s1, c1)
    else:
        q1 = seed[0]
        c1 = cosine(q1)
        s1 = sine(q1)

    # direction of A7 in the frame that A1 to A4 turn, by turning it back joint by joint
    y: cython.double = c1 * r12 - s1 * r02
    z: cython.double = c1 * r02 + s1 * r12
    x: cython.double = c2 * z - s2 * r22
    z = c2 * r22 + s2 * z
    t1: cython.double = c3 * y - s3 * x
    x = c3 * x + s3 * y
    t0: cython.double = c4 * x + s4 * z
    t2: cython.double = c4 * z - s4 * x
    s6: cython.double = sqrt(t0 * t0 + t1 * t1)
    if s6 > aligned:
        if s6 < _NEARLY_ALIGNED:
            result = _NEAR
        if status & 4:
            s6 = -s6
        c5 = t0 / s6
        s5 = t1 / s6
        q5 = arctangent(s5, c5)
    else:
        q5 = seed[4]
        c5 = cosine(q5)
        s5 = sine(q5)
        s6 = c5 * t0 + s5 * t1
        if (s6 > 0.0) == ((status & 4) != 0):
            s6 = 0.0
    # axis of A6 in the base, joint by joint: seen from there A7 has turned the flange's x and y
    x = -s5 * c4
    z = -s5 * s4
    y = s3 * x + c3 * c5
    x = c3 * x - s3 * c5
    w: cython.double = c2 * z - s2 * x
    x = c2 * x + s2 * z
    z = w
    w = c1 * x - s1 * y
    y = s1 * x + c1 * y
    x = w
    joints[row, 0] = q1
    joints[row, 1] = q2
    joints[row, 2] = redundancy
    joints[row, 3] = arctangent(s4, c4)
    joints[row, 4] = q5
    joints[row, 5] = arctangent(s6, t2)
    joints[row, 6] = arctangent(x * r00 + y * r10 + z * r20, x * r01 + y * r11 + z * r21)
    return result


@cython.ccall
@cython.exceptval(check=False)
def branch(numbers: cython.double[::1], q: cython.double[::1], distances: cython.double[::1]) -> cython.int:
    """The status of joint positions (rad), and the distances (3,) from where the branches of each of its bits
    meet: of the wrist point in x (m) of the frame that A1 turns, of A4 and of A6 (rad)."""
    d5: cython.double = numbers[2]
    reach: cython.double = sine(q[1]) * (numbers[1] + d5 * cosine(q[3]))
    distances[0] = reach - cosine(q[1]) * d5 * sine(q[3]) * cosine(q[2])
    distances[1] = q[3]
    distances[2] = q[5]
    return (distances[0] < 0.0) | (distances[1] < 0.0) << 1 | (distances[2] <= 0.0) << 2
