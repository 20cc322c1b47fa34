"""What is done one after the other, with waits in between."""

import asyncio
from collections import deque
from collections.abc import Callable


class InOrder:
    """Actions and waits of one connection. `when_idle` is called each time the last of them is over."""

    def __init__(self, when_idle: Callable[[], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._when_idle = when_idle
        self._queue: deque[Callable[[], None] | float] = deque()
        self._timer: asyncio.TimerHandle | None = None

    @property
    def busy(self) -> bool:
        """Whether anything is still to be done."""
        return self._timer is not None

    def __len__(self) -> int:
        """How many actions and waits come behind the present wait."""
        return len(self._queue)

    def do(self, action: Callable[[], None]) -> None:
        """At once, or when what came before is done."""
        if self.busy:
            self._queue.append(action)
        else:
            action()

    def wait(self, seconds: float) -> None:
        """Before what comes next."""
        if self.busy:
            self._queue.append(seconds)
        else:
            self._timer = self._loop.call_later(seconds, self._go_on)

    def forget(self) -> None:
        """Nothing of it is done any more."""
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
