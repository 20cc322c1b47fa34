"""Whole turns of joints: positions a turn apart give the same pose, and some joints can reach several.

The closed forms give angles in (-pi, pi]. A joint with a larger range reaches a part of it, or all, twice.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence

import cython
from cython.cimports.libc.math import ceil, fabs, floor

if cython.compiled:
    from cython.cimports.libc.math import rint
else:
    rint = round

_PI = cython.declare(cython.double, 3.141592653589793)
_TAU = cython.declare(cython.double, 6.283185307179586)
# Joint positions (rad) that exceed a limit by rounding are set to it. Turns, and the look at many rows, allow
# for half of that: so `clip` agrees with all that these take to be within limits.
_ROUNDING = cython.declare(cython.double, 1e-10)


@cython.ccall
@cython.exceptval(check=False)
def turn(
    joints: cython.double[:, ::1],
    row: cython.Py_ssize_t,
    present: cython.double[::1],
    lowest: cython.double[::1],
    highest: cython.double[::1],
) -> cython.void:
    """Move each joint position (rad) of a row by whole turns to the one within its limits (rad, (n,)) that is
    nearest to the present one.

    A position that is outside for any number of turns is unchanged.
    """
    for j in range(joints.shape[1]):
        if lowest[j] >= -_PI and highest[j] <= _PI:
            continue
        position = joints[row, j]
        fewest = ceil((lowest[j] - 0.5 * _ROUNDING - position) / _TAU)
        most = floor((highest[j] + 0.5 * _ROUNDING - position) / _TAU)
        if fewest <= most:
            turns = rint((present[j] - position) / _TAU)
            joints[row, j] = position + _TAU * min(max(turns, fewest), most)


@cython.ccall
@cython.exceptval(check=False)
def clip(
    joints: cython.double[:, ::1],
    row: cython.Py_ssize_t,
    lowest: cython.double[::1],
    highest: cython.double[::1],
) -> cython.bint:
    """Whether the joint positions (rad) of a row are within their limits; rounding beyond is removed."""
    for j in range(joints.shape[1]):
        position = joints[row, j]
        within = min(max(position, lowest[j]), highest[j])
        if fabs(position - within) > _ROUNDING:
            return False
        joints[row, j] = within
    return True


def turn_rows(
    joints: cython.double[:, ::1],
    present: cython.double[::1],
    lowest: cython.double[::1],
    highest: cython.double[::1],
    within: cython.uchar[::1],
) -> None:
    """`turn` for all rows (N, n), and whether each is then within the limits (N,); those with NaN are not."""
    inside: cython.bint
    for row in range(joints.shape[0]):
        turn(joints, row, present, lowest, highest)
        inside = True
        for j in range(joints.shape[1]):
            position = joints[row, j]
            if not lowest[j] - 0.5 * _ROUNDING <= position <= highest[j] + 0.5 * _ROUNDING:
                inside = False
        within[row] = inside


def continued(joints: Sequence[float], before: Sequence[float]) -> tuple[float, ...]:
    """Joint positions (rad), each moved by whole turns to be nearest to the one before, regardless of
    limits."""
    turned = []
    position: cython.double
    there: cython.double
    for j in range(len(joints)):
        position, there = joints[j], before[j]
        turned.append(position + _TAU * rint((there - position) / _TAU))
    return tuple(turned)
