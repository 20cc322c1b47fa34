"""The controllers of the robots in one cell, stepped together."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from iiwa_sim.controller.controller import Controller
from iiwa_sim.frames import IDENTITY, Transform, compose, inverse

if TYPE_CHECKING:
    from iiwa_sim.world.world import World


class Member(NamedTuple):
    """A robot of a cell."""

    controller: Controller
    base: Transform = IDENTITY
    """The pose of its base in the world."""


class ControllerGroup:
    """The controllers of one cell, in its order: a clock drives them as one robot."""

    def __init__(self, members: Sequence[Member], world: "World | None" = None) -> None:
        """`world` is the one that several robots share."""
        self.members, self._world = list(members), world
        self.controllers = [each.controller for each in members]

    def step(self) -> None:
        """Make one tick: all robots move, then their world finds the forces, then all robots feel them.

        A fault in one of them is raised at the end of the tick.
        """
        faults = []
        halves = [
            [controller.move_on for controller in self.controllers],
            [] if self._world is None else [self._world.step],
            [controller.feel for controller in self.controllers],
        ]
        for calls in halves:
            for call in calls:
                try:
                    call()
                except Exception as fault:  # noqa: BLE001 - raised below
                    faults.append(fault)
        if faults:
            raise faults[0]

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
        """True if a robot moves, or a move waits."""
        return any(controller.moving for controller in self.controllers)

    @property
    def under_way(self) -> bool:
        """True if a robot moves in a way that ends without a command."""
        return any(controller.under_way for controller in self.controllers)

    @property
    def resting(self) -> bool:
        """True if ticks change nothing of any robot that `skip` does not."""
        return all(controller.resting for controller in self.controllers)

    def seen_from(self, controller: Controller) -> Iterator[tuple[Controller, Transform]]:
        """Yield each controller, with the pose of the base of `controller` in its own base."""
        base = self.members[self.controllers.index(controller)].base
        for other in self.members:
            same = other.controller is controller
            yield other.controller, IDENTITY if same else compose(inverse(other.base), base)
