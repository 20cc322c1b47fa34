"""Where along a line a ball is nearest to a shape, or deepest in it.

Lengths are metres, in the shape's own frame; shapes, and what is remembered of a way in, are numbers as in
`ways_in_kernel`. A capsule is a line along which such a ball lies.
"""

# mypy: allow-untyped-decorators

from __future__ import annotations

import cython

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.ways_in_kernel import come_in
else:
    from iiwa_sim.contact.ways_in_kernel import come_in

_GOLDEN = cython.declare(cython.double, 0.6180339887498949)
_CUTS = cython.declare(cython.Py_ssize_t, 30)  # of a line by the golden section: to 5e-7 of its length
_FLAT_M = cython.declare(cython.double, 1e-6)  # what is nearer by less is as near


@cython.cfunc
@cython.exceptval(check=False)
def nearest_along(
    kind: cython.int,
    a: cython.double,
    b: cython.double,
    c: cython.double,
    radius: cython.double,
    x: cython.double,
    y: cython.double,
    z: cython.double,
    dx: cython.double,
    dy: cython.double,
    dz: cython.double,
    mx: cython.double,
    my: cython.double,
    mz: cython.double,
) -> tuple[cython.double, cython.double]:
    """Signed distance of the middle of a ball from a shape, by the way in `m`, where it is least on the line
    from a place along d; and at which part of that line it is."""
    low: cython.double = 0.0
    high: cython.double = 1.0
    left: cython.double = 1.0 - _GOLDEN
    right: cython.double = _GOLDEN
    at_left: cython.double = _at(kind, a, b, c, radius, x, y, z, dx, dy, dz, mx, my, mz, left)
    at_right: cython.double = _at(kind, a, b, c, radius, x, y, z, dx, dy, dz, mx, my, mz, right)
    for _cut in range(_CUTS):
        if at_left <= at_right:
            high, right, at_right = right, left, at_left
            left = high - _GOLDEN * (high - low)
            at_left = _at(kind, a, b, c, radius, x, y, z, dx, dy, dz, mx, my, mz, left)
        else:
            low, left, at_left = left, right, at_right
            right = low + _GOLDEN * (high - low)
            at_right = _at(kind, a, b, c, radius, x, y, z, dx, dy, dz, mx, my, mz, right)
    part: cython.double = 0.5 * (low + high)
    least: cython.double = _at(kind, a, b, c, radius, x, y, z, dx, dy, dz, mx, my, mz, part)
    # It jumps where a line that has come in through a face is beside that.
    if min(at_left, at_right) < least - _FLAT_M:
        part = left if at_left <= at_right else right
        least = min(at_left, at_right)
    return least, part


@cython.cfunc
@cython.exceptval(check=False)
def _at(
    kind: cython.int,
    a: cython.double,
    b: cython.double,
    c: cython.double,
    radius: cython.double,
    x: cython.double,
    y: cython.double,
    z: cython.double,
    dx: cython.double,
    dy: cython.double,
    dz: cython.double,
    mx: cython.double,
    my: cython.double,
    mz: cython.double,
    part: cython.double,
) -> cython.double:
    """Signed distance at a part of the line."""
    x, y, z = x + part * dx, y + part * dy, z + part * dz
    distance, _nx, _ny, _nz = come_in(kind, a, b, c, radius, x, y, z, mx, my, mz)
    return distance
