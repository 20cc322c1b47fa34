"""The pose of the flange while the TCP moves in a straight line and turns on the shortest arc."""

from math import cos, dist, sin

import numpy as np

from iiwa_sim.frames import Rotation, Transform, Vector, compose, multiply, rotate, turn_between

ROUNDING_RAD = 1e-12  # a smaller turn is none


class TcpLine:
    """A straight line of the TCP; s is the part of the way, and of the turn, that is done."""

    def __init__(self, start_flange: Transform, target_flange: Transform, tool_in_flange: Transform) -> None:
        """Poses in the base."""
        start, target = compose(start_flange, tool_in_flange), compose(target_flange, tool_in_flange)
        (x, y, z), angle = turn_between(start.rotation, target.rotation)
        self._angle = angle if angle > ROUNDING_RAD else 0.0
        # Rodrigues: R(s) = R0 + sin(s angle) K R0 + (1 - cos(s angle)) K K R0 turns the flange. Its origin
        # lies at -R(s) tool from the TCP, which moves straight. So each of the twelve numbers of its pose is
        # start + s way + sin sine + (1 - cos) versine.
        cross: Rotation = (0.0, -z, y, z, 0.0, -x, -y, x, 0.0)
        sine = multiply(cross, start_flange.rotation)
        versine = multiply(cross, sine)
        tool_x, tool_y, tool_z = tool_in_flange.translation
        from_tcp: Vector = (-tool_x, -tool_y, -tool_z)
        self._start = start_flange
        self._sine = (*sine, *rotate(sine, from_tcp))
        self._versine = (*versine, *rotate(versine, from_tcp))
        self._way = tuple(b - a for a, b in zip(start.translation, target.translation, strict=True))
        self.length_m = dist(start.translation, target.translation)
        """How far the TCP goes."""
        start_pose = (*start_flange.rotation, *start_flange.translation)
        self.numbers = np.array((*start_pose, *self._sine, *self._versine, *self._way, self._angle))
        """What `iiwa_sim.motion.path.line_kernel` has to know (40,): start, sine, versine, twelve each, way
        and angle."""

    def flange(self, s: float) -> Transform:
        """Pose of the flange in the base."""
        fx, fy, fz = self._start.translation
        wx, wy, wz = self._way
        fx, fy, fz = fx + s * wx, fy + s * wy, fz + s * wz
        if self._angle == 0.0:
            return Transform(self._start.rotation, (fx, fy, fz))
        f0, f1, f2, f3, f4, f5, f6, f7, f8 = self._start.rotation
        a0, a1, a2, a3, a4, a5, a6, a7, a8, ax, ay, az = self._sine
        b0, b1, b2, b3, b4, b5, b6, b7, b8, bx, by, bz = self._versine
        a, b = sin(s * self._angle), 1.0 - cos(s * self._angle)
        return Transform(
            (
                f0 + a * a0 + b * b0,
                f1 + a * a1 + b * b1,
                f2 + a * a2 + b * b2,
                f3 + a * a3 + b * b3,
                f4 + a * a4 + b * b4,
                f5 + a * a5 + b * b5,
                f6 + a * a6 + b * b6,
                f7 + a * a7 + b * b7,
                f8 + a * a8 + b * b8,
            ),
            (fx + a * ax + b * bx, fy + a * ay + b * by, fz + a * az + b * bz),
        )
