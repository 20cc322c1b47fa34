"""A robot whose ticks others see, and which may get commands in them."""

from collections.abc import Callable, Sequence

from iiwa_sim.clock.clock import Stepped


class Watched:
    """What a clock drives in place of the robot itself."""

    def __init__(
        self, robot: Stepped, ticked: Sequence[Callable[[], None]], has_commands: Callable[[], bool]
    ) -> None:
        """`ticked` are called after every tick; `has_commands` says whether that will make the robot move."""
        self._robot = robot
        self._ticked = ticked
        self._has_commands = has_commands

    def step(self) -> None:
        try:
            self._robot.step()
        finally:  # a robot that fails is still seen
            for ticked in self._ticked:
                ticked()

    @property
    def moving(self) -> bool:
        return self._robot.moving or self._has_commands()

    @property
    def under_way(self) -> bool:
        return self._robot.under_way or self._has_commands()
