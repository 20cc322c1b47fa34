"""Actions of one connection in order, with delays between them."""

import asyncio
from collections import deque
from collections.abc import Callable


class InOrder:
    """The pending actions and delays of one connection. `when_idle` is called each time none is left."""

    def __init__(self, when_idle: Callable[[], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._when_idle = when_idle
        self._queue: deque[Callable[[], None] | float] = deque()
        self._timer: asyncio.TimerHandle | None = None
        self.busy = False
        """Whether a delay is pending, and whatever comes after it."""

    def __len__(self) -> int:
        """Number of actions and delays after the present delay."""
        return len(self._queue)

    def do(self, action: Callable[[], None]) -> None:
        """Call `action` now, or after all that is pending."""
        if self.busy:
            self._queue.append(action)
        else:
            action()

    def wait(self, seconds: float) -> None:
        """Delay the actions that follow by `seconds`."""
        if self.busy:
            self._queue.append(seconds)
        else:
            self._timer = self._loop.call_later(seconds, self._go_on)
            self.busy = True

    def forget(self) -> None:
        """Drop all pending actions and delays."""
        self._queue.clear()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self.busy = False

    def _go_on(self) -> None:
        self.busy = False
        while self._queue and not self.busy:
            following = self._queue.popleft()
            if isinstance(following, float):
                self.wait(following)
            else:
                following()
        if not self.busy:
            self._when_idle()
