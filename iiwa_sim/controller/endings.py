"""How each move ended: at its target, or why not."""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

from iiwa_sim.controller.errors import SUCCESS


class Ending(NamedTuple):
    """The end of a move."""

    move: int
    """Its number."""
    code: int
    """0 where it came to its target or a force ended it as asked for, else a result code, see `errors`."""
    reason: str
    """Nothing for a move that came to its target."""


class Endings:
    """Tells listeners of the end of every move accepted since there are any, once and never early.

    Where moves blend into each other one ends where the next begins.
    """

    def __init__(self, is_pending: Callable[[int], bool]) -> None:
        """`is_pending` tells of a number whether its move runs or waits."""
        self.listeners: list[Callable[[Ending], None]] = []
        self.on_discarded: Callable[[Sequence[int], str], None] | None = None
        """Told of moves, by their numbers, that a stop or a change of mode has ended, and why."""
        self._is_pending = is_pending
        self.pending: deque[int] = deque()
        """Moves whose end has not been told."""

    def accepted(self, move: int) -> None:
        """A move of this number has been accepted."""
        if self.listeners or self.on_discarded is not None:
            self.pending.append(move)

    def after_tick(self) -> None:
        """What a tick has ended came to its target; moves end in the order of their numbers."""
        while self.pending and not self._is_pending(self.pending[0]):
            self._tell(Ending(self.pending.popleft(), SUCCESS, ""))

    @contextmanager
    def because(self, code: int, reason: str, *, discards: bool = False) -> Iterator[None]:
        """What is ended in this context has ended for this reason; `discards` where all is ended at once."""
        self.after_tick()
        yield
        if not self.pending:
            return
        ended = [move for move in self.pending if not self._is_pending(move)]
        self.pending = deque(move for move in self.pending if self._is_pending(move))
        if discards and ended and self.on_discarded is not None:
            self.on_discarded(ended, reason)
        for move in ended:
            self._tell(Ending(move, code, reason))

    def lost(self, first: int, code: int, reason: str) -> None:
        """The move of this number and all behind it will not be carried out."""
        ended = [move for move in self.pending if move >= first]
        self.pending = deque(move for move in self.pending if move < first)
        for move in ended:
            self._tell(Ending(move, code, reason))

    def _tell(self, ending: Ending) -> None:
        for listener in self.listeners:
            listener(ending)
