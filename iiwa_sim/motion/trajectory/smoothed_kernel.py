"""The sums of `iiwa_sim.motion.trajectory.smoothed`: a reference averaged over what lies just behind.

Both averages together are one with the weights of a trapezoid, which rises over the narrower width. Between
the corners of the trapezoid and the knots of the reference, weight times position is a polynomial of the
sixth degree, of which four places tell the exact integral (Gauss and Legendre).
"""

# mypy: allow-untyped-decorators

import cython

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.path.polynomial_kernel import evaluate
else:
    from iiwa_sim.motion.path.polynomial_kernel import evaluate

_NEAR = cython.declare(cython.double, 0.33998104358485626)
_FAR = cython.declare(cython.double, 0.8611363115940526)
_NEAR_WEIGHT = cython.declare(cython.double, 0.6521451548625461)
_FAR_WEIGHT = cython.declare(cython.double, 0.34785484513745385)


@cython.cfunc
@cython.exceptval(check=False)
def _weight(u: cython.double, narrow: cython.double, wide: cython.double) -> cython.double:
    """The weight, up to a factor, of what lies u behind."""
    if narrow <= 0.0:
        return 1.0
    if u < narrow:
        return u / narrow
    if u > wide:
        return (wide + narrow - u) / narrow
    return 1.0


def averaged(
    times: cython.double[::1],
    offsets: cython.Py_ssize_t[::1],
    coefficients: cython.double[:, ::1],
    order: cython.int,
    time_s: cython.double,
    narrow: cython.double,
    wide: cython.double,
    values: cython.double[:, :, ::1],
    sums: cython.double[::1],
) -> None:
    """Mean positions (order 0) or velocities (order 1) over what lies up to narrow + wide behind `time_s`.

    The result goes into `sums` (joints,); `values` is room, (2, 1, joints). `wide` is above 0.
    """
    joints: cython.Py_ssize_t = coefficients.shape[1]
    pieces: cython.Py_ssize_t = times.shape[0] - 1
    begin: cython.double = time_s - narrow - wide
    low: cython.double = begin
    high: cython.double
    half: cython.double
    place: cython.double
    weight: cython.double
    whole: cython.double = 0.0
    piece: cython.Py_ssize_t = -1
    k: cython.Py_ssize_t
    j: cython.Py_ssize_t
    side: cython.int
    for j in range(joints):
        sums[j] = 0.0
    while piece < pieces and times[piece + 1] <= low:
        piece += 1
    while low < time_s:
        # To the next knot or corner of the weights.
        high = time_s
        if piece < pieces and times[piece + 1] < high:
            high = times[piece + 1]
        if low < begin + narrow < high:
            high = begin + narrow
        if low < begin + wide < high:
            high = begin + wide
        half = 0.5 * (high - low)
        for k in range(4):
            side = -1 if k < 2 else 1
            if k == 0 or k == 3:
                place = low + half + side * _FAR * half
                weight = _FAR_WEIGHT
            else:
                place = low + half + side * _NEAR * half
                weight = _NEAR_WEIGHT
            weight = weight * half * _weight(time_s - place, narrow, wide)
            whole += weight
            if piece < 0:
                evaluate(times, offsets, coefficients, 0, times[0], 1, values, 0)
            elif piece >= pieces:
                evaluate(times, offsets, coefficients, pieces - 1, times[pieces], 1, values, 0)
            else:
                evaluate(times, offsets, coefficients, piece, place, 1, values, 0)
            if order == 0:
                for j in range(joints):
                    sums[j] += weight * values[0, 0, j]
            elif 0 <= piece < pieces:
                for j in range(joints):
                    sums[j] += weight * values[1, 0, j]
        low = high
        while piece < pieces and times[piece + 1] <= low:
            piece += 1
    for j in range(joints):
        sums[j] /= whole
