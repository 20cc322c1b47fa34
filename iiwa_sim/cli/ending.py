"""The end of a run by a signal."""

import asyncio
import signal
import sys
from collections.abc import Coroutine

from iiwa_sim.never_waiting import PATIENCE_S


class Ending:
    """Handles SIGTERM and SIGINT by an orderly end; process 1 of a container has no default for them."""

    def __init__(self) -> None:
        self.asked = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._signalled)

    def watch(self) -> None:
        """Signals set `asked` from now on instead of ending the process. To be called inside the loop."""
        self._loop = asyncio.get_running_loop()

    async def wait(self, *announced: Coroutine[None, None, None]) -> None:
        """Return when the end is requested; raise at once what goes wrong with an announcement meanwhile.

        After the request an announcement has PATIENCE_S more: it has been written long since, unless nobody
        reads.
        """
        told = {asyncio.create_task(each) for each in announced}
        ends = asyncio.create_task(self.asked.wait())
        while not ends.done():
            done, _ = await asyncio.wait({ends, *told}, return_when=asyncio.FIRST_COMPLETED)
            for each in done & told:
                each.result()
            told -= done
        if told:
            await asyncio.wait(told, timeout=PATIENCE_S)

    def _signalled(self, *_: object) -> None:
        if self._loop is None:
            sys.exit(0)
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self.asked.set)
