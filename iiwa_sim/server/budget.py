"""Fairness between the connections of all ports: each gets a piece of time in turn, after the ticks due.

A client that has nothing waiting is answered as soon as it is read. One with more to do than a piece allows
waits in a queue, and is not read meanwhile.
"""

import asyncio
import time
from collections.abc import Callable

PIECE_S = 0.0001
"""Time (s) for which one connection works without a break: enough for some replies."""
TURN_S = 0.0005
"""Time (s) for which the queue works before the event loop runs again and reads from others."""

Work = Callable[[float], bool]
"""Does work until an instant of `time.monotonic`, at least one step; returns True if there is more."""


class Budget:
    """The turns of one event loop."""

    def __init__(self, first: Callable[[], None] = lambda: None) -> None:
        """`first` is called before each piece and makes the ticks that are due."""
        self._first = first
        self._queue: dict[Work, None] = {}
        self._turn: asyncio.Handle | None = None
        self._busy = False  # some work is done now

    def ask(self, work: Work) -> bool:
        """Do some work, at once or in its turn if other work is done now; return True if some waits."""
        if work not in self._queue:
            if self._busy:
                self._enqueue(work)
            else:
                self._serve(work)
        return work in self._queue

    def _enqueue(self, work: Work) -> None:
        self._queue[work] = None
        if self._turn is None:
            self._turn = asyncio.get_running_loop().call_soon(self._take_turn)

    def _take_turn(self) -> None:
        self._turn = None
        until_s = time.monotonic() + TURN_S
        while self._queue and time.monotonic() < until_s:
            work = next(iter(self._queue))
            del self._queue[work]
            self._serve(work)
        if self._queue and self._turn is None:
            self._turn = asyncio.get_running_loop().call_soon(self._take_turn)

    def _serve(self, work: Work) -> None:
        self._busy = True
        try:
            self._first()
            more = work(time.monotonic() + PIECE_S)
        finally:
            self._busy = False
        if more:
            self._enqueue(work)
