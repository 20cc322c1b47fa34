"""An arm as capsules, anywhere: where they are at joint positions, and how far from shapes and each other."""

# mypy: allow-untyped-decorators

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import dist
from typing import Any

import cython
import numpy as np
from cython.cimports.libc.math import cos, sin, sqrt
from numpy.typing import NDArray

from iiwa_sim.contact.shapes import Shape
from iiwa_sim.contact.surface import Surface
from iiwa_sim.contact.ways_in_kernel import KINDS
from iiwa_sim.frames import IDENTITY, Transform, Vector, apply, compose, inverse
from iiwa_sim.robot.capsules import Capsule

if cython.compiled:
    from cython.cimports.iiwa_sim.contact.lines_kernel import nearest_along
    from cython.cimports.iiwa_sim.contact.ways_in_kernel import come_in
else:
    from iiwa_sim.contact.lines_kernel import nearest_along
    from iiwa_sim.contact.ways_in_kernel import come_in


@cython.cclass
class Capsules:
    """The capsules of one arm, and shapes that stand round it; the arrays are declared in the .pxd."""

    def __init__(
        self, fixed: NDArray[np.float64], capsules: Sequence[Capsule], worn: Sequence[Capsule] = ()
    ) -> None:
        """`fixed` are the constant poses between joints, of a `Tcp` without a tool; `capsules` are as in the
        base with all joints at 0, those that are `worn` as in the flange."""
        self._fixed = fixed
        self._count = count = len(fixed) - 1
        self._frames = np.zeros((count + 1, 12))
        self._axes, self._points = np.zeros((count, 3)), np.zeros((count, 3))
        frame = IDENTITY
        at_zero = [frame]
        rows = fixed.tolist()
        for row in rows[:count]:
            frame = compose(frame, Transform(tuple(row[:9]), tuple(row[9:])))
            at_zero.append(frame)
        in_last = Transform(tuple(rows[count][:9]), tuple(rows[count][9:]))
        flange = compose(frame, in_last)
        all_of_them: Any = list(capsules)
        for own in worn:
            start, end = apply(flange, own.start), apply(flange, own.end)
            all_of_them.append(own._replace(joints=count, start=start, end=end))
        self._capsules: Any = tuple(all_of_them)
        self._capsule_count = len(self._capsules)
        self._moved_by = np.array([capsule.joints for capsule in self._capsules], dtype=np.intp)
        self._radius = np.array([capsule.radius_m for capsule in self._capsules])
        local = []
        for capsule in capsules:
            frame = inverse(at_zero[capsule.joints])
            local.append((*apply(frame, capsule.start), *apply(frame, capsule.end)))
        # To the last bit as `Links.rewear` has them: jaws that come back are where they were.
        local += [(*apply(in_last, own.start), *apply(in_last, own.end)) for own in worn]
        self._local = np.array(local).reshape(len(local), 6)
        self._ends = np.zeros((len(local), 6))
        self._gone_to, self._is_there = np.zeros(count), False
        spans = [dist(one.translation, other.translation) for one, other in pairwise(at_zero)]
        reaches = [_reaches(each, at_zero[each.joints].translation, spans) for each in self._capsules]
        self._reaches = np.array(reaches).reshape(len(reaches), count)
        self._levers = np.max(self._reaches, axis=0, initial=0.0)
        self._nx = self._ny = self._nz = 0.0
        self._px = self._py = self._pz = 0.0
        self._mx = self._my = self._mz = self._around = 0.0
        self._ox = self._oy = self._oz = 0.0
        self._shape_count = 0
        self._extents: dict[Shape, float] = {}

    def stand(self, surfaces: Sequence[Surface]) -> None:
        """Set the surfaces, whose shapes are then known by their places in this sequence."""
        count = len(surfaces)
        s: cython.Py_ssize_t
        k: cython.Py_ssize_t
        self._shape_count = count
        self._shapes, self._extent = np.zeros((count, 15)), np.empty(count)
        self._kind = np.empty(count, dtype=np.intc)
        r, known = self._shapes, self._extents
        self._extents = {}
        for s in range(count):
            each = surfaces[s]
            shape, (rotation, place) = each.shape, each.pose
            for k in range(9):
                r[s, k] = rotation[k]
            for k in range(3):
                r[s, 9 + k] = place[k]
            for k in range(len(shape)):
                r[s, 12 + k] = shape[k]
            extent = known.get(shape)
            if extent is None:
                extent = shape.extent
            self._extents[shape] = self._extent[s] = extent
            self._kind[s] = KINDS[type(shape)]

    @cython.cfunc
    def go_to(self, joints: Any) -> object:
        """Find the ends of all capsules in the base, unless they are known."""
        q = self._gone_to
        known: cython.bint = self._is_there
        angle: cython.double
        for k in range(self._count):
            angle = joints[k]
            known = known and q[k] == angle
            q[k] = angle
        if known:
            return None
        self._is_there = True
        f, m = self._fixed, self._frames
        for i in range(12):
            m[0, i] = 1.0 if i in (0, 4, 8) else 0.0
        for k in range(self._count):
            for i in range(3):
                m[k + 1, 9 + i] = m[k, 9 + i] + (
                    m[k, 3 * i] * f[k, 9] + m[k, 3 * i + 1] * f[k, 10] + m[k, 3 * i + 2] * f[k, 11]
                )
            s, c = sin(q[k]), cos(q[k])
            for i in range(3):
                x = m[k, 3 * i] * f[k, 0] + m[k, 3 * i + 1] * f[k, 3] + m[k, 3 * i + 2] * f[k, 6]
                y = m[k, 3 * i] * f[k, 1] + m[k, 3 * i + 1] * f[k, 4] + m[k, 3 * i + 2] * f[k, 7]
                z = m[k, 3 * i] * f[k, 2] + m[k, 3 * i + 1] * f[k, 5] + m[k, 3 * i + 2] * f[k, 8]
                m[k + 1, 3 * i], m[k + 1, 3 * i + 1] = c * x + s * y, c * y - s * x
                m[k + 1, 3 * i + 2] = z
                self._axes[k, i], self._points[k, i] = z, m[k + 1, 9 + i]
        e, v = self._ends, self._local
        for n in range(self._capsule_count):
            k = self._moved_by[n]
            for j in range(0, 6, 3):
                for i in range(3):
                    e[n, j + i] = m[k, 9 + i] + (
                        m[k, 3 * i] * v[n, j] + m[k, 3 * i + 1] * v[n, j + 1] + m[k, 3 * i + 2] * v[n, j + 2]
                    )
        return None

    @cython.cfunc
    def gap(
        self, c: cython.Py_ssize_t, s: cython.Py_ssize_t, enough: cython.double
    ) -> tuple[cython.double, cython.double]:
        """How far (m) a capsule is from a surface, less than 0 where it is in it; and at which part of its
        line it is nearest. Where that is more than `enough` any bound of it will do."""
        e = self._ends
        ax, ay, az = e[c, 0], e[c, 1], e[c, 2]
        dx, dy, dz = e[c, 3] - ax, e[c, 4] - ay, e[c, 5] - az
        radius = self._radius[c]
        square = dx * dx + dy * dy + dz * dz
        if self._mx == 0.0 and self._my == 0.0 and self._mz == 0.0:  # else it may be deep in, behind it
            bound = self._at_least(s, ax, ay, az, dx, dy, dz, square) - radius
            if bound > enough:
                return bound, 0.5
        half = 0.5 * sqrt(square)
        middle = self.distance(s, ax + 0.5 * dx, ay + 0.5 * dy, az + 0.5 * dz)
        if half == 0.0 or middle - half - radius > enough:
            return middle - half - radius, 0.5
        # The distance to a convex body is convex along a line: from one end to the middle it is nowhere less
        # than on the straight line through middle and other end.
        if self._mx == 0.0 and self._my == 0.0 and self._mz == 0.0:
            ends = max(self.distance(s, ax, ay, az), self.distance(s, ax + dx, ay + dy, az + dz))
            bound = min(middle, 2.0 * middle - ends) - radius
            if bound > enough:
                return bound, 0.5
        x, y, z, ux, uy, uz = self._seen_from(c, s)
        mx, my, mz, r = self._mx, self._my, self._mz, self._shapes
        least, part = nearest_along(
            self._kind[s], r[s, 12], r[s, 13], r[s, 14], self._around, x, y, z, ux, uy, uz, mx, my, mz
        )
        return least - radius, part

    @cython.cfunc
    @cython.exceptval(check=False)
    def _at_least(
        self,
        s: cython.Py_ssize_t,
        ax: cython.double,
        ay: cython.double,
        az: cython.double,
        dx: cython.double,
        dy: cython.double,
        dz: cython.double,
        square: cython.double,
    ) -> cython.double:
        """No point of a line, its way d from one end to the other and the square of that, is nearer (m) to a
        shape: by the ball round that."""
        ax, ay, az = ax - self._shapes[s, 9], ay - self._shapes[s, 10], az - self._shapes[s, 11]
        part: cython.double = 0.0
        if square > 0.0:
            part = min(max(-(ax * dx + ay * dy + az * dz) / square, 0.0), 1.0)
        ax, ay, az = ax + part * dx, ay + part * dy, az + part * dz
        return sqrt(ax * ax + ay * ay + az * az) - self._extent[s]

    @cython.cfunc
    @cython.exceptval(check=False)
    def _seen_from(
        self, c: cython.Py_ssize_t, s: cython.Py_ssize_t
    ) -> tuple[cython.double, cython.double, cython.double, cython.double, cython.double, cython.double]:
        """Where a capsule's line begins, and its way to the other end, in the frame of a shape (m)."""
        e, r = self._ends, self._shapes
        x, y, z = e[c, 0] - r[s, 9], e[c, 1] - r[s, 10], e[c, 2] - r[s, 11]
        dx, dy, dz = e[c, 3] - e[c, 0], e[c, 4] - e[c, 1], e[c, 5] - e[c, 2]
        return (
            r[s, 0] * x + r[s, 3] * y + r[s, 6] * z,
            r[s, 1] * x + r[s, 4] * y + r[s, 7] * z,
            r[s, 2] * x + r[s, 5] * y + r[s, 8] * z,
            r[s, 0] * dx + r[s, 3] * dy + r[s, 6] * dz,
            r[s, 1] * dx + r[s, 4] * dy + r[s, 7] * dz,
            r[s, 2] * dx + r[s, 5] * dy + r[s, 8] * dz,
        )

    @cython.cfunc
    @cython.exceptval(check=False)
    def distance(
        self, s: cython.Py_ssize_t, px: cython.double, py: cython.double, pz: cython.double
    ) -> cython.double:
        """Signed distance (m) of a point from a surface, by the way in that m has; the way out is then in n,
        and in o, which is what is to be remembered."""
        r = self._shapes
        px, py, pz = px - r[s, 9], py - r[s, 10], pz - r[s, 11]
        x: cython.double = r[s, 0] * px + r[s, 3] * py + r[s, 6] * pz
        y: cython.double = r[s, 1] * px + r[s, 4] * py + r[s, 7] * pz
        z: cython.double = r[s, 2] * px + r[s, 5] * py + r[s, 8] * pz
        distance, nx, ny, nz = come_in(
            self._kind[s],
            r[s, 12],
            r[s, 13],
            r[s, 14],
            self._around,
            x,
            y,
            z,
            self._mx,
            self._my,
            self._mz,
        )
        self._ox, self._oy, self._oz = nx, ny, nz
        self._nx = r[s, 0] * nx + r[s, 1] * ny + r[s, 2] * nz
        self._ny = r[s, 3] * nx + r[s, 4] * ny + r[s, 5] * nz
        self._nz = r[s, 6] * nx + r[s, 7] * ny + r[s, 8] * nz
        return distance

    @cython.cfunc
    def apart(self, a: cython.Py_ssize_t, b: cython.Py_ssize_t) -> cython.double:
        """How far (m) two capsules are apart, less than 0 where they are in each other; which way is out of b
        is then in n, and the point of a that is nearest to b in p."""
        e = self._ends
        ux, uy, uz = e[a, 3] - e[a, 0], e[a, 4] - e[a, 1], e[a, 5] - e[a, 2]
        vx, vy, vz = e[b, 3] - e[b, 0], e[b, 4] - e[b, 1], e[b, 5] - e[b, 2]
        wx, wy, wz = e[a, 0] - e[b, 0], e[a, 1] - e[b, 1], e[a, 2] - e[b, 2]
        uu = ux * ux + uy * uy + uz * uz
        vv = vx * vx + vy * vy + vz * vz
        uv = ux * vx + uy * vy + uz * vz
        uw = ux * wx + uy * wy + uz * wz
        vw = vx * wx + vy * wy + vz * wz
        square = uu * vv - uv * uv
        s: cython.double = 0.0
        t: cython.double = 0.0
        if square > 1e-12 * uu * vv:
            s = min(max((uv * vw - vv * uw) / square, 0.0), 1.0)
        if vv > 0.0:
            t = min(max((uv * s + vw) / vv, 0.0), 1.0)
        if uu > 0.0:
            s = min(max((uv * t - uw) / uu, 0.0), 1.0)
        dx, dy, dz = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
        lines = sqrt(dx * dx + dy * dy + dz * dz)
        radius = self._radius[a]
        if lines > 0.0:
            self._nx, self._ny, self._nz = dx / lines, dy / lines, dz / lines
        else:
            self._nx, self._ny, self._nz = 0.0, 0.0, 1.0
        self._px = e[a, 0] + s * ux - radius * self._nx
        self._py = e[a, 1] + s * uy - radius * self._ny
        self._pz = e[a, 2] + s * uz - radius * self._nz
        return lines - radius - self._radius[b]


def _reaches(capsule: Capsule, last: Vector, spans: Sequence[float]) -> list[float]:
    """No point of a capsule is farther (m) from the axis of a joint that moves it, wherever the robot is; 0
    for any other joint. `last` is the origin of the frame it is fixed to, with all joints at 0, and `spans`
    are from each frame to the next."""
    own = max(dist(last, end) for end in (capsule.start, capsule.end))
    return [
        sum(spans[joint : capsule.joints]) + own + capsule.radius_m if joint <= capsule.joints else 0.0
        for joint in range(1, len(spans) + 1)
    ]
