"""The moves of one connection that are pending."""

from collections import deque
from collections.abc import Callable

_AT_FIRST = 64


class OwnMoves:
    """Keeps the numbers of a connection's moves; up to twice as many as are pending."""

    def __init__(self, is_pending: Callable[[int], bool]) -> None:
        """`is_pending` tells whether the move with a number runs or waits; a move that has ended stays
        ended."""
        self._is_pending = is_pending
        self._moves: deque[int] = deque()
        self._most = _AT_FIRST  # numbers kept before those of ended moves are dropped

    def add(self, move: int) -> None:
        """Note a move that has been accepted."""
        moves = self._moves
        while moves and not self._is_pending(moves[0]):  # moves mostly end in order
            moves.popleft()
        if len(moves) >= self._most:
            self._moves = moves = deque(filter(self._is_pending, moves))
            self._most = max(_AT_FIRST, 2 * len(moves))
        moves.append(move)

    @property
    def last(self) -> int | None:
        """Number of the newest move, ended or not."""
        return self._moves[-1] if self._moves else None

    def any_pending(self) -> bool:
        """Whether any move runs or waits."""
        return any(map(self._is_pending, self._moves))

    def clear(self) -> None:
        """Forget all of them."""
        self._moves.clear()
