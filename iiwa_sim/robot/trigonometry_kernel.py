"""Sine and cosine with the same bits on every machine, which C libraries do not give.

An angle is reduced to at most pi / 4 by multiples of pi / 2 in three parts (Cody and Waite, 1980), and the
rounding of the reduction is added in the end; there Taylor's series are summed as far as terms above 2.1e-18.
Up to 1e5 rad the result is within 0.9 units in the last place; beyond, the C library's is returned.
"""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc import math

# Added and subtracted to round to an integer: doubles above this have no fraction.
_WHOLE = cython.declare(cython.double, 6755399441055744.0)
# pi / 2: the first 33 bits, the next 33, and the rest. So small multiples of the first two are exact.
_HALF_PI_1 = cython.declare(cython.double, 1.5707963267341256)
_HALF_PI_2 = cython.declare(cython.double, 6.077100506303966e-11)
_HALF_PI_3 = cython.declare(cython.double, 2.0222662487959506e-21)


@cython.ccall
@cython.exceptval(check=False)
def sine(angle: cython.double) -> cython.double:
    """The sine of an angle in rad."""
    return _sine_of_quarters(angle, 0)


@cython.ccall
@cython.exceptval(check=False)
def cosine(angle: cython.double) -> cython.double:
    """The cosine of an angle in rad."""
    return _sine_of_quarters(angle, 1)


@cython.ccall
@cython.exceptval(check=False)
def sines_and_cosines(
    angles: cython.double[::1], count: cython.Py_ssize_t, found: cython.double[:, ::1]
) -> cython.void:
    """The sines of the first of some angles (rad) into the row 0 of `found`, the cosines into the row 1.

    The same to the last bit; and as none of them waits for another, in half the time.
    """
    for k in range(count):
        angle: cython.double = angles[k]
        if not -1e5 <= angle <= 1e5:
            found[0, k], found[1, k] = math.sin(angle), math.cos(angle)
            continue
        turns: cython.double = (angle * 0.6366197723675814 + _WHOLE) - _WHOLE
        near: cython.double = angle - turns * _HALF_PI_1
        x: cython.double = near - turns * _HALF_PI_2
        rest: cython.double = ((near - x) - turns * _HALF_PI_2) - turns * _HALF_PI_3
        odd: cython.double = _near_sine(x, rest)
        even: cython.double = _near_cosine(x, rest)
        quarter: cython.int = cython.cast(cython.int, turns)
        if quarter & 1:
            odd, even = even, -odd
        if quarter & 2:
            odd, even = -odd, -even
        found[0, k], found[1, k] = odd, even


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _sine_of_quarters(angle: cython.double, quarters: cython.int) -> cython.double:
    """The sine of an angle (rad) plus 0 or 1 quarters of a turn."""
    if not -1e5 <= angle <= 1e5:
        return math.cos(angle) if quarters else math.sin(angle)
    turns: cython.double = (angle * 0.6366197723675814 + _WHOLE) - _WHOLE
    near: cython.double = angle - turns * _HALF_PI_1
    x: cython.double = near - turns * _HALF_PI_2
    rest: cython.double = ((near - x) - turns * _HALF_PI_2) - turns * _HALF_PI_3
    quarter: cython.int = (cython.cast(cython.int, turns) + quarters) & 3
    result: cython.double = _near_cosine(x, rest) if quarter & 1 else _near_sine(x, rest)
    return -result if quarter & 2 else result


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _near_cosine(x: cython.double, rest: cython.double) -> cython.double:
    """The cosine of an angle (rad) of at most pi / 4 in two parts."""
    z: cython.double = x * x
    half: cython.double = 0.5 * z
    result: cython.double = 1.0 - half
    result += ((1.0 - result) - half) + (
        z
        * z
        * (
            0.041666666666666664
            + z
            * (
                -0.001388888888888889
                + z
                * (
                    2.48015873015873e-05
                    + z
                    * (
                        -2.755731922398589e-07
                        + z
                        * (2.08767569878681e-09 + z * (-1.1470745597729725e-11 + z * 4.779477332387385e-14))
                    )
                )
            )
        )
        - x * rest
    )
    return result


@cython.cfunc
@cython.inline
@cython.exceptval(check=False)
def _near_sine(x: cython.double, rest: cython.double) -> cython.double:
    """The sine of an angle (rad) of at most pi / 4 in two parts."""
    z: cython.double = x * x
    return x + (
        x
        * z
        * (
            -0.16666666666666666
            + z
            * (
                0.008333333333333333
                + z
                * (
                    -0.0001984126984126984
                    + z
                    * (
                        2.7557319223985893e-06
                        + z
                        * (
                            -2.505210838544172e-08
                            + z
                            * (
                                1.6059043836821613e-10
                                + z * (-7.647163731819816e-13 + z * 2.8114572543455206e-15)
                            )
                        )
                    )
                )
            )
        )
        + rest * (1.0 - 0.5 * z)
    )
