"""Moves that run or wait, the forces that end them, and the reason for the end of each."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

from iiwa_sim.controller.errors import SUCCESS, ErrorRecord
from iiwa_sim.controller.requests import Thresholds
from iiwa_sim.frames import Frame
from iiwa_sim.wrench import NO_WRENCH, Wrench


class Contact(NamedTuple):
    """A force that has ended a move."""

    move: int
    """Number of the force move."""
    axis: str
    """Axis of the TCP: x, y or z."""
    force_n: float
    """Force (N) on the robot, along the axis."""
    offset_n: float
    """Force (N) along the axis when the move was accepted."""
    threshold_n: float
    tcp: Frame
    """TCP in the base, in the tick in which the force has changed by more than its threshold."""

    def __str__(self) -> str:
        x_mm, y_mm, z_mm = (round(place, 3) for place in self.tcp[:3])
        return (
            f"move {self.move} ends at a force of {self.force_n:.3f} N along {self.axis} of the TCP: it was "
            f"{self.offset_n:.3f} N at the command, and the threshold is {self.threshold_n:g} N; "
            f"TCP at {x_mm} {y_mm} {z_mm} mm"
        )


class Ending(NamedTuple):
    """The end of a move."""

    move: int
    """The number of the move."""
    code: int
    """0 for a move that came to its target or met its force, else a result code, see `errors`."""
    reason: str
    """Empty for a move that came to its target."""


RobotEvent = ErrorRecord | Contact | str
"""An event between commands; a text is a link that begins to touch something."""
WhenEnded = Callable[[Ending], None]
"""Called at the end of a move, once and never early."""


class PendingMove(NamedTuple):
    """A move whose end has not been reported."""

    number: int
    when_ended: WhenEnded | None
    thresholds: Thresholds | None = None
    offset: Wrench = NO_WRENCH
    """Wrench at the command."""

    def contact(self, wrench: Wrench, tcp: Callable[[], Frame]) -> Contact | None:
        """Return the first force that is beyond its threshold, which ends the move, or None."""
        for axis, most, force, offset in zip("xyz", self.thresholds or (), wrench, self.offset, strict=False):
            if most is not None and abs(force - offset) > most:
                return Contact(self.number, axis, force, offset, most, tcp())
        return None


class Endings:
    """Reports of the end of every move that has a listener, once and never early.

    A move that blends into the next one ends when that one begins.
    """

    def __init__(self, is_pending: Callable[[int], bool]) -> None:
        """`is_pending` returns True if the move of a number runs or waits."""
        self.listeners: list[WhenEnded] = []
        """Called at the end of every move that is accepted from now on."""
        self._is_pending = is_pending
        self.pending: deque[PendingMove] = deque()
        """Moves with thresholds or a listener, in the order in which they were accepted."""

    def after_tick(self) -> None:
        """End the moves that came to their target in a tick; moves end in the order of their numbers."""
        while self.pending and not self._is_pending(self.pending[0].number):
            self._end([self.pending[0]], SUCCESS, "")

    @contextmanager
    def because(self, code: int, reason: str) -> Iterator[None]:
        """Give moves that end in this context this reason."""
        self.after_tick()
        yield
        self._end([move for move in self.pending if not self._is_pending(move.number)], code, reason)

    def lost(self, first: int, code: int, reason: str) -> None:
        """End the move of this number and all behind it: they will not be carried out."""
        self._end([move for move in self.pending if move.number >= first], code, reason)

    def _end(self, moves: Sequence[PendingMove], code: int, reason: str) -> None:
        ended = {move.number for move in moves}
        self.pending = deque(move for move in self.pending if move.number not in ended)
        for move in moves:
            for listener in (move.when_ended, *self.listeners):
                if listener is not None:
                    listener(Ending(move.number, code, reason))
