"""A gripper with two parallel jaws."""

from math import hypot
from typing import NamedTuple

JAW_M = (0.02, 0.008, 0.05)
"""Size of each jaw along x y z of the TCP (m), where a cell does not say it."""


class Jaws(NamedTuple):
    """What a gripper is like. Its jaws move along y of the TCP, both alike, and its pads end at the TCP."""

    stroke_m: float
    """Greatest distance between the jaws."""
    speed_m_per_s: float
    """Speed at which the distance between the jaws changes."""
    force_n: float
    """Force with which each jaw presses on what it holds."""
    pad_wide_m: float = 0.02
    """Width of the pads along x of the TCP, which is in the middle of it."""
    pad_long_m: float = 0.02
    """Length of the pads along z of the TCP, up to the TCP."""
    jaw_m: tuple[float, float, float] = JAW_M
    """Size of each jaw along x y z of the TCP: jaws end at the TCP, and have their distance between them."""


OPENS, STAYS, CLOSES = 1, 0, -1
"""Which way the jaws are driven."""


class Gripper:
    """The jaws over time; open at first."""

    def __init__(self, jaws: Jaws) -> None:
        self.jaws = jaws
        self.reach_m = hypot(0.5 * jaws.stroke_m, 0.5 * jaws.pad_wide_m, jaws.pad_long_m)
        """No place between the pads is farther from the TCP."""
        self.opening_m = jaws.stroke_m
        """Distance between the jaws."""
        self.driven = OPENS
        self.stuck = False
        """Whether they stay where they are, whatever drives them."""
        self.blocked = False
        """Whether a part keeps them from closing further."""

    @property
    def is_open(self) -> bool:
        return self.opening_m == self.jaws.stroke_m

    @property
    def is_closed(self) -> bool:
        """Whether jaw lies on jaw."""
        return self.opening_m == 0.0

    @property
    def holds(self) -> bool:
        """Whether they press on a part, also where they stay as they have closed on it."""
        return self.blocked and self.driven != OPENS

    def block(self, width_m: float) -> None:
        """What is between the jaws has just kept them so far apart."""
        self.opening_m, self.blocked = width_m, True

    def settled(self, driven: int) -> bool:
        """Whether they are where they stay, if they are driven that way."""
        if self.stuck:
            return True
        if driven != self.driven:
            return False
        return driven == STAYS or (self.is_open if driven == OPENS else self.is_closed or self.blocked)

    def step(self, driven: int, width_m: float, tick_s: float) -> None:
        """A tick; they cannot come closer than `width_m`, for what is between them, 0 for nothing."""
        if self.stuck:
            self.blocked = self.blocked and width_m > 0.0
            return
        self.driven = driven
        way = self.jaws.speed_m_per_s * tick_s
        if driven == OPENS:
            self.opening_m = min(self.opening_m + way, self.jaws.stroke_m)
        elif driven == CLOSES:
            self.opening_m = max(self.opening_m - way, width_m)
        self.blocked = width_m > 0.0 and self.opening_m <= width_m
