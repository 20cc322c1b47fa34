"""Paces of simulated time: real time, a multiple of it, as fast as possible, or only on request."""

import re
from typing import NamedTuple

MIN_SPEED = 0.01
MAX_SPEED = 100.0
EXPECTED = f"real, a multiple of real time from {MIN_SPEED:g}x to {MAX_SPEED:g}x, fast or stepped"

_MULTIPLE = re.compile(r"([0-9]{1,9}(?:\.[0-9]{1,9})?)x", re.ASCII)


class Pace(NamedTuple):
    """One of `REAL`, `FAST`, `STEPPED`, or a multiple of real time."""

    name: str
    """The pace as users write it: real, 10x, fast, stepped."""
    speed: float
    """Simulated seconds in a real one; for `FAST` while the robot rests, 0 for `STEPPED`."""
    is_fast: bool = False
    """True if ticks follow each other without a pause while the robot moves."""


REAL = Pace("real", 1.0)
FAST = Pace("fast", 1.0, is_fast=True)
STEPPED = Pace("stepped", 0.0)


def pace(name: str) -> Pace:
    """Return the pace with this name. Raises ValueError for any other."""
    for fixed in (REAL, FAST, STEPPED):
        if name == fixed.name:
            return fixed
    match = _MULTIPLE.fullmatch(str(name))  # a configuration may have the number 10
    if match is None or not MIN_SPEED <= (speed := float(match[1])) <= MAX_SPEED:
        raise ValueError(f"clock {name!r}: expected {EXPECTED}")
    return Pace(f"{speed:g}x", speed)
