"""The moves that came from one connection, as far as they are still to be done."""

from collections import deque
from collections.abc import Callable

_AT_FIRST = 64


class OwnMoves:
    """Remembers the numbers of moves, and some of moves that are over: as many again as are pending."""

    def __init__(self, is_pending: Callable[[int], bool]) -> None:
        """`is_pending` tells of a number whether its move runs or waits; one that is over stays so."""
        self._is_pending = is_pending
        self._moves: deque[int] = deque()
        self._most = _AT_FIRST  # to be remembered before those that are over are sought out

    def add(self, move: int) -> None:
        """A move has been accepted."""
        moves = self._moves
        while moves and not self._is_pending(moves[0]):  # most end in their order
            moves.popleft()
        if len(moves) >= self._most:
            self._moves = moves = deque(filter(self._is_pending, moves))
            self._most = max(_AT_FIRST, 2 * len(moves))
        moves.append(move)

    @property
    def last(self) -> int | None:
        """The newest one, whatever has become of it."""
        return self._moves[-1] if self._moves else None

    def any_pending(self) -> bool:
        """Whether any of them runs or waits."""
        return any(map(self._is_pending, self._moves))

    def clear(self) -> None:
        """Forget all of them."""
        self._moves.clear()
