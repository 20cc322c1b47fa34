"""A planned move: its path, its timing and its number."""

from typing import NamedTuple

from iiwa_sim.motion.path import Path
from iiwa_sim.motion.timing import Timing


class PlannedMove(NamedTuple):
    """A move ready to run. Moves are numbered in the order in which they were accepted."""

    number: int
    path: Path
    timing: Timing
