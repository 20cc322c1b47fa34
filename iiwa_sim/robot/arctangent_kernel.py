"""The arctangent of a direction, with the same bits on every machine, which C libraries do not give.

The direction is turned into the first eighth of a turn, then back by the nearest of nine angles whose
tangents are eighths: at most atan(1/16) is left, for which Taylor's series is summed as far as terms above
1e-18. The result is within 1.1 units in the last place.
"""

# mypy: allow-untyped-decorators

import cython

_PI = cython.declare(cython.double, 3.141592653589793)
_PI_REST = cython.declare(cython.double, 1.2246467991473532e-16)  # pi minus its double
# The angles, and what their doubles lack.
_ANGLES = cython.declare(cython.double[9])
_RESTS = cython.declare(cython.double[9])
for _k, _angle, _rest in (
    (0, 0.0, 0.0),
    (1, 0.12435499454676144, -3.1253241424539383e-18),
    (2, 0.24497866312686414, 1.0698755618734451e-17),
    (3, 0.35877067027057225, -2.4623815582638635e-17),
    (4, 0.4636476090008061, 2.2698777452961687e-17),
    (5, 0.5585993153435624, -5.4556305485916264e-18),
    (6, 0.6435011087932844, 1.5834785051444286e-17),
    (7, 0.7188299996216245, -2.1478388444456983e-17),
    (8, 0.7853981633974483, 3.061616997868383e-17),
):
    _ANGLES[_k] = _angle
    _RESTS[_k] = _rest


@cython.ccall
@cython.exceptval(check=False)
def arctangent(y: cython.double, x: cython.double) -> cython.double:
    """The angle (rad, above -pi, up to pi) of the direction x, y; 0 where both are 0."""
    wide: cython.double = -x if x < 0.0 else x
    high: cython.double = -y if y < 0.0 else y
    steep: cython.bint = high > wide
    if steep:
        wide, high = high, wide
    if wide == 0.0:
        return 0.0
    slope: cython.double = high / wide
    if not slope <= 1.0:  # not a number
        return x + y
    k: cython.int = cython.cast(cython.int, 8.0 * slope + 0.5)
    eighths: cython.double = 0.125 * k
    t: cython.double = (high - eighths * wide) / (wide + eighths * high)
    z: cython.double = t * t
    # The large parts are exact or rounded once; the remainder is added to the small ones.
    large: cython.double = _ANGLES[k]
    series: cython.double = 0.1111111111111111 + z * (
        -0.09090909090909091 + z * (0.07692307692307693 - z * 0.06666666666666667)
    )
    series = -0.3333333333333333 + z * (0.2 + z * (-0.14285714285714285 + z * series))
    small: cython.double = t * z * series + _RESTS[k]
    if steep:
        large, t, small = 0.5 * _PI - large, -t, 0.5 * _PI_REST - small
    if x < 0.0:
        large, t, small = _PI - large, -t, _PI_REST - small
    angle: cython.double = large + (t + small)
    return -angle if y < 0.0 and angle < _PI else angle
