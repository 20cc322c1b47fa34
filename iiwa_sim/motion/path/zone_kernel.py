"""The sums of `iiwa_sim.motion.path.zone`: distances from a target, and where a path leaves a zone."""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc.math import fabs, sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.path.polynomial_kernel import evaluate, piece_at
    from cython.cimports.iiwa_sim.robot.trigonometry_kernel import cosine, sine
else:
    from iiwa_sim.motion.path.polynomial_kernel import evaluate, piece_at
    from iiwa_sim.robot.trigonometry_kernel import cosine, sine

_PLACES = cython.declare(cython.int, 12)  # that are looked at, to find where a path leaves a zone first
_CLOSE = cython.declare(cython.double, 1e-9)  # in s


@cython.ccall
@cython.exceptval(check=False)
def tcp_distance(
    fixed: cython.double[:, ::1],
    centre: cython.double[::1],
    joints: cython.double[:, ::1],
    row: cython.Py_ssize_t,
) -> cython.double:
    """How far the TCP is from the centre (m) at that row of joint positions (rad); `fixed` is `Tcp.fixed`."""
    last: cython.Py_ssize_t = fixed.shape[0] - 1
    x: cython.double = fixed[last, 9]
    y: cython.double = fixed[last, 10]
    z: cython.double = fixed[last, 11]
    for k in range(last - 1, -1, -1):
        s = sine(joints[row, k])
        c = cosine(joints[row, k])
        u = c * x - s * y
        v = s * x + c * y
        x = fixed[k, 9] + fixed[k, 0] * u + fixed[k, 1] * v + fixed[k, 2] * z
        y = fixed[k, 10] + fixed[k, 3] * u + fixed[k, 4] * v + fixed[k, 5] * z
        z = fixed[k, 11] + fixed[k, 6] * u + fixed[k, 7] * v + fixed[k, 8] * z
    x -= centre[0]
    y -= centre[1]
    z -= centre[2]
    return sqrt(x * x + y * y + z * z)


@cython.ccall
@cython.exceptval(check=False)
def joint_distance(
    centre: cython.double[::1], joints: cython.double[:, ::1], row: cython.Py_ssize_t
) -> cython.double:
    """How far the farthest joint of that row is from where it is in the centre (rad)."""
    farthest: cython.double = 0.0
    for j in range(centre.shape[0]):
        farthest = max(farthest, fabs(joints[row, j] - centre[j]))
    return farthest


@cython.cfunc
@cython.exceptval(check=False)
def distance(
    fixed: cython.double[:, ::1],
    centre: cython.double[::1],
    joints: cython.double[:, ::1],
    row: cython.Py_ssize_t,
) -> cython.double:
    """How far that row of joint positions is from the centre: the TCP (m), or, with no `fixed` rows, the
    farthest joint (rad)."""
    if fixed.shape[0] == 0:
        return joint_distance(centre, joints, row)
    return tcp_distance(fixed, centre, joints, row)


def distances(
    fixed: cython.double[:, ::1],
    centre: cython.double[::1],
    joints: cython.double[:, ::1],
    found: cython.double[::1],
) -> None:
    """The distances (m,) of rows of joint positions (m, n): of the TCP (m), or, with no `fixed` rows, of the
    farthest joint (rad)."""
    for row in range(joints.shape[0]):
        found[row] = distance(fixed, centre, joints, row)


def part_inside(
    fixed: cython.double[:, ::1],
    centre: cython.double[::1],
    radius: cython.double,
    borders: cython.double[::1],
    offsets: cython.Py_ssize_t[::1],
    coefficients: cython.double[:, ::1],
    at_end: cython.bint,
    most: cython.double,
    room: cython.double[:, :, ::1],
) -> cython.double:
    """The part of a path from its beginning, or its end backwards, up to `most`, that is within the radius.

    `room` (1, 1, n) is for its own use.
    """
    inside: cython.double = 0.0
    outside: cython.double = 0.0
    left: cython.double = radius  # of it at the one inside,
    beyond: cython.double = 0.0  # and how far the other is outside
    last: cython.int = 0  # which of both was found last
    for k in range(1, _PLACES + 1):
        part = most * k / _PLACES
        beyond = _distance(fixed, centre, borders, offsets, coefficients, at_end, part, room) - radius
        if beyond > 0.0:
            outside = part
            break
        inside, left = part, -beyond
    if outside == 0.0:
        return most
    while outside - inside > _CLOSE and left > _CLOSE * radius:
        # False position; where one side stays, it counts half.
        part = inside + (outside - inside) * left / (left + beyond)
        if not inside < part < outside:
            part = 0.5 * (inside + outside)
        beyond_there = _distance(fixed, centre, borders, offsets, coefficients, at_end, part, room) - radius
        if beyond_there > 0.0:
            outside, beyond = part, beyond_there
            if last == 1:
                left *= 0.5
            last = 1
        else:
            inside, left = part, -beyond_there
            if last == -1:
                beyond *= 0.5
            last = -1
    return inside


@cython.cfunc
@cython.exceptval(check=False)
def _distance(
    fixed: cython.double[:, ::1],
    centre: cython.double[::1],
    borders: cython.double[::1],
    offsets: cython.Py_ssize_t[::1],
    coefficients: cython.double[:, ::1],
    at_end: cython.bint,
    part: cython.double,
    room: cython.double[:, :, ::1],
) -> cython.double:
    s: cython.double = 1.0 - part if at_end else part
    evaluate(borders, offsets, coefficients, piece_at(borders, s), s, 0, room, 0)
    return distance(fixed, centre, room[0], 0)
