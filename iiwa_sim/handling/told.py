"""Parts, of which is told what becomes of the one in the jaws: once each, and ticks ask for nothing more."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from iiwa_sim.frames import Transform
from iiwa_sim.handling.grip import Between
from iiwa_sim.handling.workpieces import Workpieces
from iiwa_sim.wording import harmless

HOLDS = "the gripper holds part {!r}"
LETS_GO = "part {!r} is let go: the jaws have opened"
SLIPS = "part {!r} has slipped out of the jaws"
LOST = "part {!r} falls out of the jaws: made to through the backdoor"
REMOVED = "part {!r} is gone: made to through the backdoor"

Tell = Callable[[str, bool], None]
"""Takes a line, and whether that is a warning."""


def nobody(told: str, warns: bool) -> None:
    """Hears nothing."""


class ToldWorkpieces(Workpieces):
    """What a named state brings back is not told: nothing has happened to it."""

    tell: Tell = staticmethod(nobody)
    _leaves = LETS_GO  # what is told of a part that leaves the jaws now

    def lose(self) -> None:
        """The part in the jaws is held no more: it has slipped."""
        with self._leaving(SLIPS):
            super().lose()

    def drop(self) -> None:
        """A fault: the part in the jaws falls, and is not held again before they have opened."""
        with self._leaving(LOST):
            super().lose()

    def remove(self, name: str) -> None:
        """A fault: take a part away."""
        with self._leaving(""):
            super().remove(name)
        self._told(REMOVED, name)

    def _grasp(self, it: Between, tcp: Transform) -> None:
        super()._grasp(it, tcp)
        self._told(HOLDS, it.name)

    def _let_go(self) -> None:
        name = self.held
        super()._let_go()
        if name:
            self._told(self._leaves, name)

    @contextmanager
    def _leaving(self, told: str) -> Iterator[None]:
        """What leaves the jaws meanwhile is told of so, and not at all if that is empty."""
        self._leaves = told
        try:
            yield
        finally:
            self._leaves = LETS_GO

    def _told(self, what: str, name: str) -> None:
        if what:
            self.tell(harmless(what.format(name)), what == SLIPS)
