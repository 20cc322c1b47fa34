"""The moves that run or wait, and how each ended: at its target, or why not."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

from iiwa_sim.controller.errors import SUCCESS
from iiwa_sim.controller.force_guard import ForceGuard


class Ending(NamedTuple):
    """The end of a move."""

    move: int
    """The number of the move."""
    code: int
    """0 where it came to its target or a force ended it as asked for, else a result code, see `errors`."""
    reason: str
    """Nothing for a move that came to its target."""


WhenEnded = Callable[[Ending], None]
"""Told of the end of a move, once and never early."""


class PendingMove(NamedTuple):
    """A move whose end has not been told."""

    number: int
    when_ended: WhenEnded | None
    """The function of whoever asked for the move, to be told of its end."""
    guard: ForceGuard | None
    """The force threshold that ends the move."""


class Endings:
    """Tells of the end of every move that somebody wants to hear of, once and never early.

    Where moves blend into each other one ends where the next begins.
    """

    def __init__(self, is_pending: Callable[[int], bool]) -> None:
        """`is_pending` tells of a number whether its move runs or waits."""
        self.listeners: list[WhenEnded] = []
        """Told of the end of every move that has been accepted since they are here."""
        self.on_discarded: Callable[[Sequence[int], str], None] | None = None
        """Told of moves, by their numbers, that a stop or a change of mode has ended, and why."""
        self._is_pending = is_pending
        self.pending: deque[PendingMove] = deque()
        """In the order in which they were accepted; who accepts a move that has a guard, or that somebody
        wants to hear of, adds it."""

    def after_tick(self) -> None:
        """End the moves that came to their target in a tick; moves end in the order of their numbers."""
        while self.pending and not self._is_pending(self.pending[0].number):
            self._tell(self.pending.popleft(), SUCCESS, "")

    @contextmanager
    def because(self, code: int, reason: str, *, discards: bool = False) -> Iterator[None]:
        """Give moves that end in this context this reason; `discards` where all is ended at once."""
        self.after_tick()
        yield
        ended: list[PendingMove] = []
        pending = deque[PendingMove]()
        for move in self.pending:
            (pending if self._is_pending(move.number) else ended).append(move)
        if not ended:
            return
        self.pending = pending
        if discards and self.on_discarded is not None:
            self.on_discarded([move.number for move in ended], reason)
        for move in ended:
            self._tell(move, code, reason)

    def lost(self, first: int, code: int, reason: str) -> None:
        """The move of this number and all behind it will not be carried out."""
        ended = [move for move in self.pending if move.number >= first]
        self.pending = deque(move for move in self.pending if move.number < first)
        for move in ended:
            self._tell(move, code, reason)

    def _tell(self, move: PendingMove, code: int, reason: str) -> None:
        ending = Ending(move.number, code, reason)
        if move.when_ended is not None:
            move.when_ended(ending)
        for listener in self.listeners:
            listener(ending)
