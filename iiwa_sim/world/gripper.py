"""A gripper: two parallel jaws, or a suction cup."""

from __future__ import annotations

from typing import NamedTuple

OPENS, STAYS, CLOSES = 1, 0, -1
"""Directions in which the outputs drive the jaws."""


class Jaws(NamedTuple):
    """Two jaws that move along y of the TCP, both alike, and whose pads end at the TCP."""

    stroke_m: float  # greatest distance between the jaws
    speed_m_per_s: float  # speed at which that distance changes
    force_n: float  # force of each jaw on the held part
    pad_wide_m: float = 0.02  # width of the pads along x of the TCP, which is in the middle of it
    pad_long_m: float = 0.02  # length of the pads along z of the TCP, up to the TCP
    jaw_m: tuple[float, float, float] = (0.02, 0.008, 0.05)  # size of each jaw along x y z of the TCP


class Cup(NamedTuple):
    """A suction cup that ends at the TCP, open along z of it."""

    force_n: float  # force up to which it holds a part
    radius_m: float
    length_m: float = 0.02


class Gripper:
    """The gripper over time; open at first."""

    def __init__(self, kind: Jaws | Cup) -> None:
        self.kind = kind
        self.stroke_m = kind.stroke_m if isinstance(kind, Jaws) else 0.0
        self.opening_m = self.stroke_m  # distance between the jaws
        self.driven = OPENS
        self.stuck = False  # True: the jaws stay where they are, whatever drives them
        self.blocked = False  # True: something keeps the jaws from closing further, or the cup holds a part

    @property
    def state(self) -> str:
        """The state: holds, open, closed or between.

        It holds while it presses on a part, also where jaws stay as they have closed on it. Jaws are open at
        their stroke, closed where they touch; a cup is closed while it sucks on nothing.
        """
        if self.blocked and self.driven != OPENS:
            return "holds"
        if isinstance(self.kind, Cup):
            return "closed" if self.driven == CLOSES else "open"
        if self.opening_m == self.stroke_m:
            return "open"
        return "between" if self.opening_m else "closed"
