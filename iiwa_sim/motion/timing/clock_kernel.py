"""The inner loops of the clock: an interior-point method for b(theta) = (dtheta/dt)^2, compiled by Cython.

theta counts cells; c (N + 2) are the coefficients of a quadratic B-spline: at the knot k, b = (c[k] + c[k
+ 1]) / 2 and db/dtheta = c[k + 1] - c[k]; in the cell k, d2b/dtheta2 = c[k] - 2 c[k + 1] + c[k + 2]. What
bounds it is told in `bounds_kernel`. All arrays are C-contiguous float64.
"""

# mypy: allow-untyped-decorators

import cython
from cython.cimports.libc.math import fabs, sqrt

if cython.compiled:
    from cython.cimports.iiwa_sim.motion.timing.bounds_kernel import Bounds
else:
    from iiwa_sim.motion.timing.bounds_kernel import Bounds

LN2 = cython.declare(cython.double, 0.6931471805599453)
FAR = cython.declare(cython.double, 1e300)  # the barrier where a limit is passed
TIE = cython.declare(cython.double, 10.0)  # keeps the ends, where nothing moves yet, like what is beside them
TINY = cython.declare(cython.double, 8.636168555094445e-78)  # 2^-256
LEAST = cython.declare(cython.double, 1e-300)  # of what a loop scales
LARGEST = cython.declare(cython.double, 1e300)
HUGE = cython.declare(cython.double, 1.157920892373162e77)  # 2^256


@cython.cfunc
@cython.inline
def _log(x: cython.double) -> cython.double:
    """The natural logarithm of x > 0 by operations that are the same on all machines, unlike those of
    libraries."""
    shift: cython.double = 0.0
    square: cython.double
    y: cython.double
    total: cython.double
    k: cython.int
    if x > LARGEST:
        x = LARGEST
    if x < LEAST:
        x = LEAST
    while x < 1.1102230246251565e-16:
        x *= 9007199254740992.0
        shift -= 53.0
    while x < 0.70710678:
        x *= 2.0
        shift -= 1.0
    while x > 1.41421357:
        x *= 0.5
        shift += 1.0
    y = (x - 1.0) / (x + 1.0)
    square = y * y
    total = 1.0 / 23.0
    for k in range(10, -1, -1):
        total = total * square + 1.0 / (2.0 * k + 1.0)
    return 2.0 * y * total + shift * LN2


@cython.cfunc
def _mean_time(c: cython.double[::1], cells: cython.Py_ssize_t) -> cython.double:
    """Of a cell, by the value of b in its middle."""
    k: cython.Py_ssize_t
    time: cython.double = 0.0
    for k in range(cells):
        time += 1.0 / sqrt((c[k] + 6.0 * c[k + 1] + c[k + 2]) * 0.125)
    return time / cells


@cython.cfunc
def _barrier(
    bounds: Bounds,
    c: cython.double[::1],
    mu: cython.double,
    fixed: cython.Py_ssize_t,
) -> cython.double:
    """The time that is to be least, plus mu times how near all limits are, and 0 is to each c, which stays
    above it; FAR where one is passed."""
    cells: cython.Py_ssize_t = bounds.cells
    k: cython.Py_ssize_t
    i: cython.Py_ssize_t
    e: cython.Py_ssize_t
    b: cython.double
    d: cython.double
    dd: cython.double
    mid: cython.double
    x: cython.double
    y: cython.double
    least: cython.double
    twos: cython.double = 0.0
    product: cython.double = 1.0
    time: cython.double = 0.0
    for k in range(cells + 1):
        b = 0.5 * (c[k] + c[k + 1])
        d = c[k + 1] - c[k]
        if not (b > 0.0 and c[k] > 0.0 and c[k + 1] > 0.0):
            return FAR
        least = 1.0 - b / bounds.cap[k]
        if not least > 0.0:
            return FAR
        product *= least * c[k]
        for i in range(bounds.counts[k, 0]):
            y = bounds.a2[k, i] * b + bounds.a1[k, i] * d
            x = 1.0 - y * y
            if x < least:
                least = x
            product *= x
        if not least > 0.0:
            return FAR
        if product < TINY:
            product *= HUGE
            twos += 256.0
        elif product > HUGE:
            product *= TINY
            twos -= 256.0
        if k == cells:
            product *= c[k + 1]
            break
        mid = (c[k] + 6.0 * c[k + 1] + c[k + 2]) * 0.125
        dd = c[k] - 2.0 * c[k + 1] + c[k + 2]
        if not c[k + 2] > 0.0:
            return FAR
        time += 1.0 / sqrt(mid)
        for e in range(2):
            if e == 1:
                b = 0.5 * (c[k + 1] + c[k + 2])
                d = c[k + 2] - c[k + 1]
            for i in range(bounds.counts[k, 1 + e]):
                y = bounds.j3[2 * k + e, i] * b + bounds.j2[2 * k + e, i] * d + bounds.j1[2 * k + e, i] * dd
                x = 1.0 - b * y * y
                if x < least:
                    least = x
                product *= x
            if not least > 0.0:
                return FAR
            if product < TINY:
                product *= HUGE
                twos += 256.0
    if fixed == 0:
        d = c[1] - c[0]
        time += TIE * d * d
    d = c[cells + 1] - c[cells]
    time += TIE * d * d
    return time + mu * (twos * LN2 - _log(product))


@cython.cfunc
def _assemble(
    bounds: Bounds,
    c: cython.double[::1],
    mu: cython.double,
    fixed: cython.Py_ssize_t,
    gradient: cython.double[::1],
    band: cython.double[:, ::1],
) -> cython.void:
    """Gradient and (Gauss-Newton) Hessian of the barrier; of the Hessian the diagonal and two bands beside
    it."""
    cells: cython.Py_ssize_t = bounds.cells
    m: cython.Py_ssize_t = cells + 2
    k: cython.Py_ssize_t
    i: cython.Py_ssize_t
    e: cython.Py_ssize_t
    o: cython.Py_ssize_t
    b: cython.double
    d: cython.double
    dd: cython.double
    x: cython.double
    y: cython.double
    inv: cython.double
    first: cython.double
    second: cython.double
    root: cython.double
    half: cython.double
    mid: cython.double
    g: cython.double
    h: cython.double
    gb: cython.double
    gd: cython.double
    hbb: cython.double
    hbd: cython.double
    hdd: cython.double
    f0: cython.double
    f1: cython.double
    f2: cython.double
    g0: cython.double
    g1: cython.double
    g2: cython.double
    h00: cython.double
    h01: cython.double
    h02: cython.double
    h11: cython.double
    h12: cython.double
    h22: cython.double
    u0: cython.double
    v0: cython.double
    z0: cython.double
    u1: cython.double
    v1: cython.double
    z1: cython.double
    u2: cython.double
    v2: cython.double
    z2: cython.double
    for i in range(m):
        gradient[i] = -mu / c[i]
        band[i, 0] = mu / (c[i] * c[i])
        band[i, 1] = 0.0
        band[i, 2] = 0.0
    for e in range(2):
        if e == 0 and fixed > 0:
            continue
        k = 0 if e == 0 else m - 2
        d = 2.0 * TIE * (c[k + 1] - c[k])
        gradient[k] -= d
        gradient[k + 1] += d
        band[k, 0] += 2.0 * TIE
        band[k, 1] -= 2.0 * TIE
        band[k + 1, 0] += 2.0 * TIE
    for k in range(cells + 1):
        b = 0.5 * (c[k] + c[k + 1])
        d = c[k + 1] - c[k]
        inv = 1.0 / (bounds.cap[k] - b)
        gb = mu * inv
        gd = 0.0
        hbb = mu * inv * inv
        hbd = 0.0
        hdd = 0.0
        for i in range(bounds.counts[k, 0]):
            f0 = bounds.a2[k, i]
            f1 = bounds.a1[k, i]
            y = f0 * b + f1 * d
            x = 1.0 / (1.0 - y * y)
            first = 2.0 * mu * y * x
            second = 2.0 * mu * (1.0 + y * y) * x * x
            gb += first * f0
            gd += first * f1
            hbb += second * f0 * f0
            hbd += second * f0 * f1
            hdd += second * f1 * f1
        gradient[k] += 0.5 * gb - gd
        gradient[k + 1] += 0.5 * gb + gd
        band[k, 0] += 0.25 * hbb - hbd + hdd
        band[k, 1] += 0.25 * hbb - hdd
        band[k + 1, 0] += 0.25 * hbb + hbd + hdd
        if k == cells:
            break
        mid = (c[k] + 6.0 * c[k + 1] + c[k + 2]) * 0.125
        root = sqrt(mid)
        g = -0.5 / (mid * root)
        h = 0.75 / (mid * mid * root)
        gradient[k] += 0.125 * g
        gradient[k + 1] += 0.75 * g
        gradient[k + 2] += 0.125 * g
        band[k, 0] += 0.015625 * h
        band[k, 1] += 0.09375 * h
        band[k, 2] += 0.015625 * h
        band[k + 1, 0] += 0.5625 * h
        band[k + 1, 1] += 0.09375 * h
        band[k + 2, 0] += 0.015625 * h
        dd = c[k] - 2.0 * c[k + 1] + c[k + 2]
        for e in range(2):
            o = 2 * k + e
            if e == 1:
                b = 0.5 * (c[k + 1] + c[k + 2])
                d = c[k + 2] - c[k + 1]
            root = sqrt(b)
            half = 0.5 / root
            g0 = 0.0
            g1 = 0.0
            g2 = 0.0
            h00 = 0.0
            h01 = 0.0
            h02 = 0.0
            h11 = 0.0
            h12 = 0.0
            h22 = 0.0
            for i in range(bounds.counts[k, 1 + e]):
                y = bounds.j3[o, i] * b + bounds.j2[o, i] * d + bounds.j1[o, i] * dd
                f0 = half * y + root * bounds.j3[o, i]
                f1 = root * bounds.j2[o, i]
                f2 = root * bounds.j1[o, i]
                y = root * y
                x = 1.0 / (1.0 - y * y)
                first = 2.0 * mu * y * x
                second = 2.0 * mu * (1.0 + y * y) * x * x
                g0 += first * f0
                g1 += first * f1
                g2 += first * f2
                h00 += second * f0 * f0
                h01 += second * f0 * f1
                h02 += second * f0 * f2
                h11 += second * f1 * f1
                h12 += second * f1 * f2
                h22 += second * f2 * f2
            # In c[k], c[k + 1], c[k + 2]: b, db and d2b go with (u, v, z).
            if e == 0:
                u0, v0, z0 = 0.5, -1.0, 1.0
                u1, v1, z1 = 0.5, 1.0, -2.0
                u2, v2, z2 = 0.0, 0.0, 1.0
            else:
                u0, v0, z0 = 0.0, 0.0, 1.0
                u1, v1, z1 = 0.5, -1.0, -2.0
                u2, v2, z2 = 0.5, 1.0, 1.0
            gradient[k] += g0 * u0 + g1 * v0 + g2 * z0
            gradient[k + 1] += g0 * u1 + g1 * v1 + g2 * z1
            gradient[k + 2] += g0 * u2 + g1 * v2 + g2 * z2
            f0 = h00 * u0 + h01 * v0 + h02 * z0
            f1 = h01 * u0 + h11 * v0 + h12 * z0
            f2 = h02 * u0 + h12 * v0 + h22 * z0
            band[k, 0] += f0 * u0 + f1 * v0 + f2 * z0
            band[k, 1] += f0 * u1 + f1 * v1 + f2 * z1
            band[k, 2] += f0 * u2 + f1 * v2 + f2 * z2
            f0 = h00 * u1 + h01 * v1 + h02 * z1
            f1 = h01 * u1 + h11 * v1 + h12 * z1
            f2 = h02 * u1 + h12 * v1 + h22 * z1
            band[k + 1, 0] += f0 * u1 + f1 * v1 + f2 * z1
            band[k + 1, 1] += f0 * u2 + f1 * v2 + f2 * z2
            f0 = h00 * u2 + h01 * v2 + h02 * z2
            f1 = h01 * u2 + h11 * v2 + h12 * z2
            f2 = h02 * u2 + h12 * v2 + h22 * z2
            band[k + 2, 0] += f0 * u2 + f1 * v2 + f2 * z2


@cython.cfunc
def _solve(
    gradient: cython.double[::1],
    band: cython.double[:, ::1],
    step: cython.double[::1],
    fixed: cython.Py_ssize_t,
) -> cython.bint:
    """Newton's step from row `fixed` on, by L D L' of the band, in place; False where it is not positive."""
    m: cython.Py_ssize_t = gradient.shape[0]
    i: cython.Py_ssize_t
    d: cython.double
    e: cython.double
    f: cython.double
    for i in range(fixed, m):
        d = band[i, 0]
        if not d > 0.0:
            return False
        e = band[i, 1]
        f = band[i, 2]
        if i + 1 < m:
            band[i + 1, 0] -= e * e / d
            band[i + 1, 1] -= e * f / d
            band[i, 1] = e / d
        if i + 2 < m:
            band[i + 2, 0] -= f * f / d
            band[i, 2] = f / d
    for i in range(fixed, m):
        e = -gradient[i]
        if i - 1 >= fixed:
            e -= band[i - 1, 1] * step[i - 1]
        if i - 2 >= fixed:
            e -= band[i - 2, 2] * step[i - 2]
        step[i] = e
    for i in range(m - 1, fixed - 1, -1):
        e = step[i] / band[i, 0]
        if i + 1 < m:
            e -= band[i, 1] * step[i + 1]
        if i + 2 < m:
            e -= band[i, 2] * step[i + 2]
        step[i] = e
    return True


def newton(
    bounds: Bounds,
    c: cython.double[::1],
    vectors: cython.double[:, ::1],
    band: cython.double[:, ::1],
    mu: cython.double,
    mu_end: cython.double,
    cut: cython.double,
    fixed: cython.Py_ssize_t,
    most: cython.Py_ssize_t,
) -> tuple[float, int, bool]:
    """At most so many Newton steps from a feasible c (N + 2,), changed in place from `fixed` on; it stays
    feasible.

    `mu` weighs the barrier, in parts of the mean time of a cell; after each step that went well it is
    cut, down to `mu_end`. Gives mu for the next call, the number of steps, and whether there is nothing
    left to gain. `vectors` (3, N + 2) and `band` (N + 2, 3) are scratch.
    """
    cells: cython.Py_ssize_t = bounds.cells
    m: cython.Py_ssize_t = cells + 2
    gradient: cython.double[::1] = vectors[0]
    step: cython.double[::1] = vectors[1]
    trial: cython.double[::1] = vectors[2]
    done: cython.Py_ssize_t = 0
    i: cython.Py_ssize_t
    _: cython.int
    scale: cython.double
    value: cython.double
    new: cython.double
    slope: cython.double
    size: cython.double
    t: cython.double
    moved: cython.bint
    over: cython.bint = False
    scale = _mean_time(c, cells)
    value = _barrier(bounds, c, mu * scale, fixed)
    if value >= FAR:
        return mu, 0, True
    while done < most:
        _assemble(bounds, c, mu * scale, fixed, gradient, band)
        if not _solve(gradient, band, step, fixed):
            over = True
            break
        slope = 0.0
        size = 1e-300
        for i in range(fixed, m):
            slope += gradient[i] * step[i]
            t = fabs(step[i]) / c[i]
            if t > size:
                size = t
        for i in range(fixed):
            trial[i] = c[i]
        t = 1.0 if size < 2.0 else 2.0 / size
        moved = False
        for _ in range(25):
            for i in range(fixed, m):
                trial[i] = c[i] + t * step[i]
            new = _barrier(bounds, trial, mu * scale, fixed)
            if new < value + 1e-4 * t * slope:
                moved = True
                break
            t *= 0.6
        done += 1
        if moved:
            for i in range(fixed, m):
                c[i] = trial[i]
        if mu <= mu_end and (not moved or -slope < 0.001 * mu * scale * cells):
            over = True
            break
        if not moved or t > 0.3:
            mu = mu * cut
            if mu < mu_end:
                mu = mu_end
        scale = _mean_time(c, cells)
        value = _barrier(bounds, c, mu * scale, fixed)
    return mu, done, over
