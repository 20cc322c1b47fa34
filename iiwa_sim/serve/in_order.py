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

    @property
    def busy(self) -> bool:
        """Whether an action or a delay is pending."""
        return self._timer is not None

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

    def forget(self) -> None:
        """Drop all pending actions and delays."""
        self._queue.clear()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _go_on(self) -> None:
        self._timer = None
        while self._queue and self._timer is None:
            following = self._queue.popleft()
            if isinstance(following, float):
                self._timer = self._loop.call_later(following, self._go_on)
            else:
                following()
        if self._timer is None:
            self._when_idle()
