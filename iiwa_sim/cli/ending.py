"""How a run ends that goes on until a signal."""

import asyncio
import signal
import sys


class Ending:
    """SIGTERM and SIGINT end in good order; process 1 of a container has no default for them."""

    def __init__(self) -> None:
        self.asked = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._signalled)

    def watch(self) -> None:
        """From now on, set `asked` instead of leaving at once. To be called inside the loop."""
        self._loop = asyncio.get_running_loop()

    def _signalled(self, *_: object) -> None:
        if self._loop is None:
            sys.exit(0)
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self.asked.set)
