"""What a clock drives: a robot, alone or with others who see its ticks."""

from typing import Protocol


class Stepped(Protocol):
    """What the clock drives."""

    def step(self) -> None:
        """One tick."""

    @property
    def accepted(self) -> int:
        """How many moves the robot has accepted since its start."""

    @property
    def moving(self) -> bool:
        """Whether the robot moves, or a move waits."""

    @property
    def under_way(self) -> bool:
        """Whether it moves, and not so that only a command can end that."""

    @property
    def resting(self) -> bool:
        """Whether ticks change nothing that `skip` does not, and nobody sees them."""

    def skip(self, ticks: int) -> None:
        """Make up for `ticks` ticks at once; only while it is `resting`."""
