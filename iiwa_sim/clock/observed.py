"""The robot that a clock steps, alone or with observers that see its ticks and may command it in them."""

from collections.abc import Sequence
from typing import Protocol


class Stepped(Protocol):
    """The robot as a clock drives it."""

    def step(self) -> None:
        """One tick."""

    @property
    def accepted(self) -> int:
        """How many moves the robot has accepted since its start."""

    @property
    def moving(self) -> bool:
        """Return True if the robot moves, or a move waits."""

    @property
    def under_way(self) -> bool:
        """Return True if it moves in a way that ends without a command."""

    @property
    def resting(self) -> bool:
        """Return True if ticks change nothing that `skip` does not, and nobody sees them."""

    def skip(self, ticks: int) -> None:
        """Make up for `ticks` ticks at once; only while it is `resting`."""


class TickObserver(Protocol):
    """Sees the ticks of a robot."""

    def tick(self) -> None:
        """The robot has made a tick."""

    def skip(self, ticks: int) -> None:
        """A robot at rest has made `ticks` ticks at once, while this watcher was not `watching`."""

    @property
    def watching(self) -> bool:
        """Return True if it has to see each tick, also of a robot at rest."""

    @property
    def has_commands(self) -> bool:
        """Return True if it will make the robot move in the next ticks."""


class ObservedRobot:
    """Robot and observers, which a clock drives together."""

    def __init__(self, robot: Stepped, watchers: Sequence[TickObserver]) -> None:
        self._robot = robot
        self._watchers = watchers

    def step(self) -> None:
        try:
            self._robot.step()
        finally:  # a robot that fails is still seen
            for watcher in self._watchers:
                watcher.tick()

    def skip(self, ticks: int) -> None:
        self._robot.skip(ticks)
        for watcher in self._watchers:
            watcher.skip(ticks)

    @property
    def accepted(self) -> int:
        return self._robot.accepted

    @property
    def moving(self) -> bool:
        return self._robot.moving or self._has_commands

    @property
    def under_way(self) -> bool:
        return self._robot.under_way or self._has_commands

    @property
    def resting(self) -> bool:
        return self._robot.resting and not any(watcher.watching for watcher in self._watchers)

    @property
    def _has_commands(self) -> bool:
        return any(watcher.has_commands for watcher in self._watchers)
