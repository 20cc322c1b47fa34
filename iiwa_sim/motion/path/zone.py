"""Where a move may leave its path to blend into the next one: a zone round its target."""

from collections.abc import Sequence
from copy import copy
from typing import Self

import numpy as np

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.limits import Array
from iiwa_sim.motion.path import zone_kernel
from iiwa_sim.motion.path.piecewise_kernel import Polynomial
from iiwa_sim.robot.tcp_kernel import Tcp

HALF = 0.49
"""A path is left to blends up to this part from either end, so that it is never all blends."""
STANDSTILL = 1e-7  # m or rad
_NO_TCP = np.empty((0, 12))


class Zone:
    """A neighbourhood of a target: everything no farther from it than `radius`."""

    radius: float
    """In m, or rad for a ball of joints."""

    def __init__(self, radius: float, centre: Sequence[float], fixed: Array) -> None:
        """`fixed` is `Tcp.fixed`, or an array without rows where distances are those of joints."""
        self.radius = radius
        self.centre = np.array(centre)
        self.fixed = fixed

    def distances(self, joints: Array) -> Array:
        """How far rows of joint positions (m, n), in rad, are from the target (m,)."""
        found = np.empty(len(joints))
        rows = np.ascontiguousarray(joints, dtype=np.float64)
        zone_kernel.distances(self.fixed, self.centre, rows, found)
        return found

    def distance(self, joints: Sequence[float]) -> float:
        """How far joint positions (rad) are from the target."""
        return float(self.distances(np.array([joints]))[0])

    def clipped(self, first: Polynomial, second: Polynomial) -> Self:
        """This zone, made so small that it ends before the middle of the path to its target and of that from
        it."""
        halves = self.distances(np.array([first.joints(1.0 - HALF), second.joints(HALF)])).tolist()
        clipped = copy(self)
        # A line that turns on the spot goes nowhere: there half of the turn is the only bound.
        clipped.radius = min([self.radius, *(half for half in halves if half > STANDSTILL)])
        return clipped

    def part_inside(self, path: Polynomial, *, at_end: bool) -> float:
        """The part of a path, up to `HALF`, from the target at one of its ends to the border."""
        room = np.empty((1, 1, path.coefficients.shape[1]))
        part: float = zone_kernel.part_inside(
            self.fixed, self.centre, self.radius, path.borders, path.offsets, path.coefficients, at_end,
            HALF, room,
        )  # fmt: skip
        return part


class Sphere(Zone):
    """All places where the TCP is no farther than a radius (m) from where it is at the target."""

    def __init__(self, radius_m: float, target: Joints, tcp: Tcp) -> None:
        """`target` are joint positions (rad)."""
        super().__init__(radius_m, tcp.pose(target).translation, tcp.fixed)

    def part_inside(self, path: Polynomial, *, at_end: bool) -> float:
        """The part of a path, up to `HALF`, from the target at one of its ends to the border of the
        sphere."""
        length_m = path.tcp_length_m
        if length_m is None:
            return super().part_inside(path, at_end=at_end)
        return HALF if self.radius >= HALF * length_m else self.radius / length_m


class JointBall(Zone):
    """All places where no joint is farther (rad) from the target than a part of the largest way of a move."""

    def __init__(self, part: float, start: Joints, target: Joints) -> None:
        way = max([abs(b - a) for a, b in zip(start, target, strict=True)])
        super().__init__(part * way, target, _NO_TCP)
