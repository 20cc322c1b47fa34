"""The controllers of the robots in one cell, stepped together, and observers of their ticks."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from iiwa_sim.controller.controller import Controller

if TYPE_CHECKING:
    from iiwa_sim.world.world import World


class ControllerGroup:
    """The controllers of one cell, in its order: a clock drives them as one robot."""

    def __init__(self, controllers: Sequence[Controller], world: "World | None" = None) -> None:
        """Several robots share the `world`."""
        self.controllers = controllers
        self.observers: Sequence[Any] = ()
        """Their `tick()` is called after each tick of the robots, and may command them.
        While one is `watching`, robots at rest tick, too; one that `has_commands` will make a robot move."""
        self._calls = [controller.move_on for controller in self.controllers]
        self._calls += [] if world is None else [world.step]
        self._calls += [controller.take_forces for controller in self.controllers]

    def step(self, at_most: int = 1) -> int:  # noqa: ARG002 a single robot may make several at once
        """Make one tick: all robots move, their world finds the forces, and all robots take them.

        A fault in one of them is raised at the end of the tick, which observers see nevertheless. Return 1.
        """
        faults = []
        for call in self._calls:
            try:
                call()
            except Exception as fault:  # noqa: BLE001 - raised below
                faults.append(fault)
        for observer in self.observers:
            observer.tick()
        if faults:
            raise faults[0]
        return 1

    def skip(self, ticks: int) -> None:
        """Make up for `ticks` ticks of all robots, while they rest."""
        for controller in self.controllers:
            controller.skip(ticks)

    def stop(self) -> None:
        """Stop all robots."""
        for controller in self.controllers:
            controller.stop()

    @property
    def accepted(self) -> int:
        """The number of moves that all robots have accepted."""
        return sum(controller.accepted for controller in self.controllers)

    @property
    def moving(self) -> bool:
        """True if a robot moves, or a move waits or will come from an observer."""
        return any(each.moving for each in self.controllers) or self._has_commands

    @property
    def under_way(self) -> bool:
        """True if a robot moves and will stop without a command, or an observer has one."""
        return any(each.under_way for each in self.controllers) or self._has_commands

    @property
    def resting(self) -> bool:
        """True if ticks change nothing of any robot that `skip` does not, and no observer needs them."""
        if any(observer.watching for observer in self.observers):
            return False
        return all(controller.resting for controller in self.controllers)

    @property
    def _has_commands(self) -> bool:
        return any(observer.has_commands for observer in self.observers)
