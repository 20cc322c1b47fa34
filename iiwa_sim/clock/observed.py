"""A robot whose ticks others see, and which may get commands in them."""

from collections.abc import Sequence
from typing import Protocol

from iiwa_sim.clock.stepped import Stepped


class TickObserver(Protocol):
    """Sees the ticks of a robot."""

    def tick(self) -> None:
        """The robot has made a tick."""

    def skip(self, ticks: int) -> None:
        """A robot at rest has made `ticks` ticks at once, while this watcher was not `watching`."""

    @property
    def watching(self) -> bool:
        """Whether it has to see each tick, also of a robot at rest."""

    @property
    def has_commands(self) -> bool:
        """Whether it will make the robot move in the next ticks."""


class ObservedRobot:
    """What a clock drives in place of the robot itself."""

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
