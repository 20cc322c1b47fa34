"""The pose of the flange while the TCP moves in a straight line and turns on the shortest arc."""

from math import dist

import numpy as np

from iiwa_sim.frames import Rotation, Transform, Vector, compose, multiply, rotate, turn_between
from iiwa_sim.motion.path import line_kernel

ROUNDING_RAD = 1e-12  # a smaller turn is none


class TcpLine:
    """A straight line of the TCP; s is the part of the way, and of the turn, that is done."""

    def __init__(self, start_flange: Transform, target_flange: Transform, tool_in_flange: Transform) -> None:
        """Poses in the base."""
        start, target = compose(start_flange, tool_in_flange), compose(target_flange, tool_in_flange)
        (x, y, z), angle = turn_between(start.rotation, target.rotation)
        angle = angle if angle > ROUNDING_RAD else 0.0
        # Rodrigues: R(s) = R0 + sin(s angle) K R0 + (1 - cos(s angle)) K K R0 turns the flange. Its origin
        # lies at -R(s) tool from the TCP, which moves straight. So each of the twelve numbers of its pose is
        # start + s way + sin sine + (1 - cos) versine.
        cross: Rotation = (0.0, -z, y, z, 0.0, -x, -y, x, 0.0)
        sine = multiply(cross, start_flange.rotation)
        versine = multiply(cross, sine)
        tool_x, tool_y, tool_z = tool_in_flange.translation
        from_tcp: Vector = (-tool_x, -tool_y, -tool_z)
        sines, versines = (*sine, *rotate(sine, from_tcp)), (*versine, *rotate(versine, from_tcp))
        way = tuple(b - a for a, b in zip(start.translation, target.translation, strict=True))
        self.length_m = dist(start.translation, target.translation)
        """How far the TCP goes."""
        start_pose = (*start_flange.rotation, *start_flange.translation)
        self.numbers = np.array((*start_pose, *sines, *versines, *way, angle))
        """What `iiwa_sim.motion.path.line_kernel` has to know (40,): start, sine, versine, twelve each, way
        and angle."""

    def flange(self, s: float) -> Transform:
        """Pose of the flange in the base."""
        poses = np.empty((1, 12))
        line_kernel.pose(self.numbers, s, poses, 0)
        numbers = tuple(poses[0].tolist())
        return Transform(numbers[:9], numbers[9:])
