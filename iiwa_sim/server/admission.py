"""Admission of clients: all at once, or one after the other, with an optional pause between them."""

import asyncio
from typing import Protocol

LONGEST_PAUSE_S = 86400.0


class Client(Protocol):
    """A client that waits to be served."""

    def serve(self) -> None:
        """Start serving: called when the client is admitted."""


class Admission:
    """Admits clients in the order in which they connect.

    With `exclusive` one at a time, the next when that one has gone; otherwise all at once. When no client is
    left, the next one is admitted `pause_s` later.
    """

    def __init__(self, exclusive: bool = False, pause_s: float = 0.0) -> None:
        """Raises ValueError for a pause that is negative or longer than a day."""
        if not 0.0 <= pause_s <= LONGEST_PAUSE_S:
            raise ValueError(f"reconnect_pause_s is {pause_s}, expected 0 to {LONGEST_PAUSE_S:g} s")
        self._exclusive = exclusive
        self._pause_s = pause_s
        self._served: set[Client] = set()
        self._waiting: dict[Client, None] = {}  # in their order
        self._pause: asyncio.TimerHandle | None = None

    def arrives(self, client: Client) -> bool:
        """Whether the client is admitted at once; if not, its `serve` is called later."""
        if self._busy:
            self._waiting[client] = None
            return False
        self._served.add(client)
        return True

    def leaves(self, client: Client) -> None:
        """Forget a client that has gone, served or not."""
        self._waiting.pop(client, None)
        if client not in self._served:
            return
        self._served.remove(client)
        if self._pause_s and not self._served:
            self._pause = asyncio.get_running_loop().call_later(self._pause_s, self._pause_is_over)
        else:
            self._admit()

    def close(self) -> None:
        """Admit nobody any more."""
        self._waiting.clear()
        self._served.clear()
        if self._pause is not None:
            self._pause.cancel()
            self._pause = None

    @property
    def _busy(self) -> bool:
        return self._pause is not None or (self._exclusive and bool(self._served))

    def _pause_is_over(self) -> None:
        self._pause = None
        self._admit()

    def _admit(self) -> None:
        while self._waiting and not self._busy:
            client = next(iter(self._waiting))
            del self._waiting[client]
            self._served.add(client)
            client.serve()
