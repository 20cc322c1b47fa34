"""The sums of `iiwa_sim.motion.path.lin`: poses along a line, their joints, and a polynomial through these.

A line is given by forty numbers, those of `TcpLine.numbers`.
"""

# mypy: allow-untyped-decorators

import cython

if cython.compiled:
    from cython.cimports.iiwa_sim.robot.inverse_kernel import solve
    from cython.cimports.iiwa_sim.robot.trigonometry_kernel import cosine, sine
else:
    from iiwa_sim.robot.inverse_kernel import solve
    from iiwa_sim.robot.trigonometry_kernel import cosine, sine

NOT_RESOLVED = 0
SINGULAR = -1
OUT_OF_REACH = -2
HOPELESS = -3

_NEAR = cython.declare(cython.int, 1)
_OUT_OF_REACH = cython.declare(cython.int, 2)
_PI = cython.declare(cython.double, 3.141592653589793)
_TAU = cython.declare(cython.double, 6.283185307179586)
_HALVINGS = cython.declare(cython.int, 50)  # of a step, to find where branches meet
# Coefficients (rad) below this are left out.
_NOTHING = cython.declare(cython.double, 1e-13)
# With the last three coefficients (rad) below this a piece is resolved: where derivatives have to agree with
# those of neighbours, and where there are none.
_RESOLVED = cython.declare(cython.double, 1e-12)
_RESOLVED_ALONE = cython.declare(cython.double, 1e-11)
# With more a polynomial of twice the degree would not do either.
_TOO_MUCH = cython.declare(cython.double, 1e-4)
# Near singular poses rounding shows in all coefficients: below this, and where they do not fall any more.
_ROUNDING = cython.declare(cython.double, 1e-8)
_LEVEL = cython.declare(cython.double, 10.0)


def nodes_and_weights(degree: cython.int, nodes: cython.double[::1], weights: cython.double[:, ::1]) -> None:
    """The places (degree + 1,) in -1..1 where a polynomial of that degree is fitted, ends included, and what
    each value there counts in each coefficient (degree + 1, degree + 1)."""
    for k in range(degree + 1):
        nodes[k] = sine(_PI * (2 * k - degree) / (2 * degree))
    nodes[0] = -1.0
    nodes[degree] = 1.0
    for j in range(degree + 1):
        for k in range(degree + 1):
            weight = 2.0 / degree * cosine(_PI * ((j * (degree - k)) % (2 * degree)) / degree)
            if k == 0 or k == degree:
                weight *= 0.5
            if j == 0 or j == degree:
                weight *= 0.5
            weights[j, k] = weight


def places(
    kind: cython.int,
    numbers: cython.double[::1],
    line: cython.double[::1],
    redundancy: cython.double,
    redundancy_way: cython.double,
    statuses: cython.longlong[::1],
    seed: cython.double[::1],
    aligned: cython.double,
    s: cython.double[::1],
    poses: cython.double[:, ::1],
    joints: cython.double[:, ::1],
    results: cython.schar[::1],
) -> None:
    """The pose of the flange (12: rotation, place in m) and the joint positions (n,) at each s (m,).

    Results (m,) are those of `iiwa_sim.robot.inverse_kernel.solve_rows`.
    """
    for row in range(s.shape[0]):
        pose(line, s[row], poses, row)
        own = redundancy + s[row] * redundancy_way
        results[row] = solve(kind, numbers, poses, row, own, statuses[row], seed, aligned, joints)


def meeting(
    kind: cython.int,
    numbers: cython.double[::1],
    line: cython.double[::1],
    redundancy: cython.double,
    redundancy_way: cython.double,
    own: cython.int,
    other: cython.int,
    seed: cython.double[::1],
    before: cython.double,
    after: cython.double,
    coming: cython.double[::1],
    going: cython.double[::1],
    poses: cython.double[:, ::1],
    joints: cython.double[:, ::1],
) -> tuple[float, float]:
    """The s between `before` and `after` up to which the branch `own`, and from which on `other`, is nearer
    to an even way of the joints from coming to going (rad, (n,)): where the two meet, if they do.

    A branch that does not reach a place is far. `poses` (1, 12) and `joints` (1, n) are for its own use.
    """
    low: cython.double = before
    high: cython.double = after
    k: cython.int = 0
    while k < _HALVINGS:
        k += 1
        s = 0.5 * (low + high)
        part = (s - before) / (after - before)
        redundant = redundancy + s * redundancy_way
        pose(line, s, poses, 0)
        one = another = 1e9
        if solve(kind, numbers, poses, 0, redundant, own, seed, 0.0, joints) != _OUT_OF_REACH:
            one = _off(joints, coming, going, part)
        if solve(kind, numbers, poses, 0, redundant, other, coming, 0.0, joints) != _OUT_OF_REACH:
            another = _off(joints, coming, going, part)
        if one <= another:
            low = s
        else:
            high = s
    return low, high


@cython.cfunc
@cython.exceptval(check=False)
def _off(
    joints: cython.double[:, ::1],
    coming: cython.double[::1],
    going: cython.double[::1],
    part: cython.double,
) -> cython.double:
    """How far a joint is from the part of the way from coming to going (rad), but for whole turns."""
    farthest: cython.double = 0.0
    off: cython.double
    for j in range(joints.shape[1]):
        off = joints[0, j] - coming[j] - part * (going[j] - coming[j])
        while off > _PI:
            off -= _TAU
        while off < -_PI:
            off += _TAU
        farthest = max(farthest, off, -off)
    return farthest


def fit(
    kind: cython.int,
    numbers: cython.double[::1],
    line: cython.double[::1],
    redundancy: cython.double,
    redundancy_way: cython.double,
    status: cython.int,
    seed: cython.double[::1],
    aligned: cython.double,
    near: cython.bint,
    low: cython.double,
    high: cython.double,
    reference: cython.double[::1],
    nodes: cython.double[::1],
    weights: cython.double[:, ::1],
    poses: cython.double[:, ::1],
    joints: cython.double[:, ::1],
    coefficients: cython.double[:, ::1],
) -> cython.Py_ssize_t:
    """A polynomial through the joints of a line from s = low to high, on a branch: rows of coefficients.

    Each joint goes on from where it was, the first from the reference (n,), however often that is around.
    Ends are met but for rounding. Returns how many rows there are, or one of the constants above: where a
    pose is out of reach or, unless that is allowed, near a singular one, and where it takes more nodes, or a
    shorter piece.
    """
    count: cython.Py_ssize_t = joints.shape[1]
    last: cython.Py_ssize_t = nodes.shape[0] - 1
    alone: cython.bint = low == 0.0 and high == 1.0
    total: cython.double
    largest: cython.double
    for k in range(last + 1):
        s = high if k == last else low + 0.5 * (high - low) * (1.0 + nodes[k])
        pose(line, s, poses, k)
        own = redundancy + s * redundancy_way
        result = solve(kind, numbers, poses, k, own, status, seed, aligned, joints)
        if result == _OUT_OF_REACH:
            return OUT_OF_REACH
        if result == _NEAR and not near:
            return SINGULAR
        for j in range(count):
            before = joints[k - 1, j] if k > 0 else reference[j]
            while joints[k, j] - before > _PI:
                joints[k, j] -= _TAU
            while joints[k, j] - before < -_PI:
                joints[k, j] += _TAU
    if low == 0.0:
        for j in range(count):
            joints[0, j] = reference[j]
    nothing: cython.double = _NOTHING
    tail: cython.double = 0.0
    level: cython.double = 0.0
    for i in range(last, -1, -1):
        largest = 0.0
        for j in range(count):
            total = 0.0
            for k in range(last + 1):
                total += weights[i, k] * joints[k, j]
            coefficients[i, j] = total
            largest = max(largest, total, -total)
        if i > last - 3:
            tail = max(tail, largest)
            if tail > _TOO_MUCH:
                return HOPELESS
        elif i > last - last // 2:
            level = max(level, largest)
        elif tail > (_RESOLVED_ALONE if alone else _RESOLVED):
            if tail > _ROUNDING or level > _LEVEL * tail:
                return NOT_RESOLVED
            nothing = max(nothing, 4.0 * tail)
    rows = last + 1
    while rows > 2:
        largest = 0.0
        for j in range(count):
            largest = max(largest, coefficients[rows - 1, j], -coefficients[rows - 1, j])
        if largest > nothing:
            break
        rows -= 1
    meet(coefficients, rows, joints, last)
    return rows


@cython.cfunc
@cython.exceptval(check=False)
def meet(
    coefficients: cython.double[:, ::1],
    rows: cython.Py_ssize_t,
    joints: cython.double[:, ::1],
    last: cython.Py_ssize_t,
) -> cython.void:
    """What is missing of the first and last joint positions, added evenly along the piece."""
    first_off: cython.double
    last_off: cython.double
    for j in range(joints.shape[1]):
        first_off = joints[0, j]
        last_off = joints[last, j]
        sign = 1.0
        for i in range(rows):
            first_off -= sign * coefficients[i, j]
            last_off -= coefficients[i, j]
            sign = -sign
        coefficients[0, j] += 0.5 * (first_off + last_off)
        coefficients[1, j] += 0.5 * (last_off - first_off)


@cython.ccall
@cython.exceptval(check=False)
def pose(
    line: cython.double[::1], s: cython.double, poses: cython.double[:, ::1], row: cython.Py_ssize_t
) -> cython.void:
    """The pose of the flange in the base at s, into that row."""
    half: cython.double = 0.5 * s * line[39]
    a: cython.double = sine(half)
    versine: cython.double = 2.0 * a * a
    a = 2.0 * a * cosine(half)
    for k in range(12):
        poses[row, k] = line[k] + a * line[12 + k] + versine * line[24 + k]
    for k in range(3):
        poses[row, 9 + k] += s * line[36 + k]
