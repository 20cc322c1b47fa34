"""Force moves: which forces end them, and what is told when one does."""

from collections.abc import Callable
from math import isfinite
from typing import NamedTuple

from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.frames import Frame
from iiwa_sim.wrench import Wrench

AXES = ("x", "y", "z")

Thresholds = tuple[float | None, float | None, float | None]
"""Thresholds of the force along x, y and z of the TCP (N); None where it is not watched."""


class Contact(NamedTuple):
    """A force that has ended a move."""

    move: int
    """Number of the force move."""
    axis: str
    """Axis of the TCP: x, y or z."""
    force_n: float
    """Force (N) on the robot, along the axis."""
    offset_n: float
    """Force (N) along the axis when the move was accepted."""
    threshold_n: float
    tcp: Frame
    """TCP in the base, in the tick in which the force has changed by more than its threshold."""

    def __str__(self) -> str:
        x_mm, y_mm, z_mm = (round(place, 3) for place in self.tcp[:3])
        return (
            f"move {self.move} ends at a force of {self.force_n:.3f} N along {self.axis} of the TCP: it was "
            f"{self.offset_n:.3f} N at the command, and the threshold is {self.threshold_n:g} N; "
            f"TCP at {x_mm} {y_mm} {z_mm} mm"
        )


class ForceGuard(NamedTuple):
    """Thresholds of force changes for a running move."""

    move: int
    thresholds: Thresholds
    offset: Wrench
    """Wrench at the command."""

    def contact(self, wrench: Wrench, tcp: Callable[[], Frame]) -> Contact | None:
        """Return the force that ends the move, or None; of several the farthest beyond its threshold."""
        offset, thresholds = self.offset, self.thresholds
        beyond = []
        for n in range(3):
            threshold, force = thresholds[n], wrench[n]
            if threshold is not None and abs(force - offset[n]) > threshold:
                beyond.append((abs(force - offset[n]) / threshold, AXES[n], force, offset[n], threshold))
        return Contact(self.move, *max(beyond)[1:], tcp()) if beyond else None


def check_thresholds(thresholds: Thresholds) -> None:
    """Raises `Refused` where one is not above 0 and finite."""
    for axis, threshold in zip(AXES, thresholds, strict=True):
        if threshold is not None and not (isfinite(threshold) and threshold > 0.0):
            raise Refused(EXECUTION, f"threshold along {axis} {threshold:g} N: expected above 0 and finite")
