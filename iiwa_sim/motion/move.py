"""A move that the drive can run: its path, and how to find its timing."""

from collections.abc import Callable
from typing import NamedTuple

from iiwa_sim.motion.path import Path
from iiwa_sim.motion.timing import Timing


class Move(NamedTuple):
    """A move ready to run. Moves are numbered in the order in which they were accepted."""

    number: int
    path: Path
    timing: Callable[[], Timing]
    """Plans the timing. It is asked for when the move begins: it costs more than all checks of the path, and
    whoever sent the move need not wait for it."""
