"""Wrench of weight and inertia of a body that is fixed to the TCP."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from iiwa_sim.frames import Transform, Vector
from iiwa_sim.robot.arm_kernel import carried_wrench
from iiwa_sim.wrench import Wrench

GRAVITY_M_S2 = 9.81
"""Down is against z of the world."""
Moments = NDArray[np.float64]
"""Pseudo-inertia (4, 4) of a body: the integral of [r; 1] [r; 1]^T over its mass (kg, m).

Moments of bodies that are fixed to each other add up, and a difference acts like a body.
"""
NO_MOMENTS: Moments = np.zeros((4, 4))


def body(mass_kg: float, centre: Vector, inertia: Sequence[float] = (0.0,) * 6) -> Moments:
    """Return the moments of a body.

    Args:
        mass_kg: Mass.
        centre: Centre of mass (m).
        inertia: ixx, iyy, izz, ixy, ixz, iyz about the centre of mass (kg m^2), with the signs of URDF.
    """
    xx, yy, zz, xy, xz, yz = inertia
    about_centre = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    moments: Moments = pin.Inertia(mass_kg, np.array(centre), about_centre).toPseudoInertia().toMatrix()
    return moments


def seen_from(moments: Moments, frame: Transform) -> Moments:
    """Return moments in an outer frame, of those in another frame whose pose in the outer one is `frame`."""
    (a, b, c, d, e, f, g, h, i), (x, y, z) = frame
    matrix: Moments = np.array(((a, b, c, x), (d, e, f, y), (g, h, i, z), (0.0, 0.0, 0.0, 1.0)))
    return matrix @ moments @ matrix.T


def size_of(*moments: Moments) -> NDArray[np.float64]:
    """Return mass (kg), first (kg m) and second moments (kg m2), without directions and signs."""
    whole = np.abs(moments).sum(axis=0)
    return np.array((whole[3, 3], whole[3, :3].sum(), whole[:3, :3].sum()))


class TcpMotion:
    """Poses of a TCP in three consecutive ticks, and the wrench of a body that moves with it.

    A point r of the body accelerates by p'' + R'' r. Both second derivatives are those at the middle pose. If
    the coming pose is known, the middle one is the present one; otherwise inertia acts a tick late.
    """

    def __init__(self, pose: Transform) -> None:
        """Begin at a pose; the velocity there is not known."""
        self._poses: tuple[Transform | None, Transform | None, Transform] = (None, None, pose)
        self._motion: Any = None  # three poses, the middle one with the acceleration; None for rest
        self._tick_s = 0.0
        self.still = False
        """True if all three poses are the same."""

    def rest(self, pose: Transform) -> None:
        """Rest at a pose."""
        self._poses = (pose, pose, pose)
        self._motion, self.still = None, True

    def step(self, pose: Transform, tick_s: float, coming: Transform | None = None) -> None:
        """Make a tick that ends at `pose`; the next one ends at `coming`, if that is known."""
        _, earlier, before = self._poses
        self._poses = (earlier, before, pose)
        poses = self._poses if coming is None else (before, pose, coming)
        self.still = poses[0] == poses[1] == poses[2]
        self._motion, self._tick_s = None if self.still or None in poses else poses, tick_s

    def wrench(self, moments: Moments, *, moving: bool = True) -> Wrench:
        """Return the wrench of moments in the TCP, along its axes: of weight, and of inertia if `moving`."""
        motion = self._motion if moving else None
        wrench: Wrench = carried_wrench(self._poses[2], motion, self._tick_s, moments)
        return wrench
