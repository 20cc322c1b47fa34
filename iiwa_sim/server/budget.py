"""Fairness between the connections of all ports: each gets a piece of time in turn, after the ticks due.

A client that has nothing waiting is answered as soon as it is read. One with more to do than a piece allows
waits in a queue, and is not read meanwhile.
"""

import asyncio
import time
from collections import deque
from collections.abc import Callable

PIECE_S = 0.0001
"""Time (s) for which one connection works without a break: enough for some replies."""
TURN_S = 0.0005
"""Time (s) for which the queue works before the event loop runs again and reads from others."""


class Budget:
    """The turns of one event loop."""

    def __init__(self, first: Callable[[], None] = lambda: None) -> None:
        """`first` is called before each piece and makes the ticks that are due."""
        self._first = first
        self._queue: deque[Share] = deque()
        self._turn: asyncio.Handle | None = None
        self._busy = False  # a share works

    def share(self, work: Callable[[float], bool]) -> "Share":
        """Return the share of one connection.

        `work(until_s)` does some of the waiting work, at least one step and not beyond `until_s` of
        `time.monotonic`, and returns whether there is more.
        """
        return Share(self, work)

    def ask(self, share: "Share", at_once: bool) -> None:
        """Let a share work: at once unless another one works, or in its turn."""
        if share.waits or share.left:
            return
        if at_once and not self._busy:
            self._serve(share)
            return
        share.waits = True
        self._queue.append(share)
        if self._turn is None:
            self._turn = asyncio.get_running_loop().call_soon(self._take_turn)

    def _take_turn(self) -> None:
        self._turn = None
        until_s = time.monotonic() + TURN_S
        while self._queue:
            share = self._queue.popleft()
            share.waits = False
            if not share.left:
                self._serve(share)
            if time.monotonic() >= until_s:
                break
        if self._queue and self._turn is None:
            self._turn = asyncio.get_running_loop().call_soon(self._take_turn)

    def _serve(self, share: "Share") -> None:
        self._busy = True
        try:
            self._first()
            more = share.work(time.monotonic() + PIECE_S)
        finally:
            self._busy = False
        if more:
            self.ask(share, at_once=False)


class Share:
    """The turns of one connection."""

    def __init__(self, budget: Budget, work: Callable[[float], bool]) -> None:
        self.work = work
        self.waits = False
        """True while it is in the queue."""
        self.left = False
        self._budget = budget

    def ask(self) -> None:
        """Work at once, unless it waits already or another share works."""
        self._budget.ask(self, at_once=True)

    def ask_later(self) -> None:
        """Work after the caller has returned."""
        self._budget.ask(self, at_once=False)

    def leave(self) -> None:
        """Withdraw: no more work is done for this share."""
        self.left = True
