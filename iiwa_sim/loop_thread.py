"""An asyncio loop in a thread of its own, for those who have none."""

import asyncio
import threading
from collections.abc import Callable, Coroutine
from concurrent.futures import CancelledError, Future
from typing import Any, TypeVar

T = TypeVar("T")


class LoopThread:
    """Runs from its making until `close`.

    A daemon: a program that ends without closing it ends nevertheless.
    """

    def __init__(self, name: str) -> None:
        # The loop of the thread that calls this stays what it is: so the factory.
        self._runner = asyncio.Runner(loop_factory=asyncio.new_event_loop)
        self._loop = self._runner.get_loop()
        self._lock = threading.Lock()
        self._waited_for: set[Future[Any]] = set()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @property
    def current(self) -> bool:
        """Whether the caller is in this thread."""
        return threading.current_thread() is self._thread

    def wait_for(self, function: Callable[[], Coroutine[Any, Any, T]]) -> T:
        """Run a coroutine in the loop and wait for its end; what it raises is raised here.

        If the wait is interrupted, the coroutine is cancelled. Raises RuntimeError in this thread itself,
        where that would wait for ever, and where the loop is closed, also if that happens meanwhile.
        """
        if self.current:
            raise RuntimeError("the loop cannot wait for itself")
        with self._lock:
            if self._closed:
                raise RuntimeError("the loop is closed")
            coroutine = function()
            waited_for = asyncio.run_coroutine_threadsafe(coroutine, self._loop)
            self._waited_for.add(waited_for)
        try:
            return waited_for.result()
        except CancelledError:
            raise RuntimeError("the loop was closed") from None
        finally:
            waited_for.cancel()
            with self._lock:
                self._waited_for.discard(waited_for)
                if self._closed:
                    coroutine.close()  # if it never began, Python would complain

    def close(self) -> None:
        """Cancel what still runs in the loop, end the thread and wait for that."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()

    def _run(self) -> None:
        try:
            with self._runner:
                self._loop.run_forever()
        finally:
            with self._lock:
                self._closed = True
                for waited_for in self._waited_for:
                    waited_for.cancel()
