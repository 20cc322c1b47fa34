"""An asyncio event loop in a thread of its own, for callers that have no loop."""

import asyncio
import os
import sys
import threading
import traceback
from collections.abc import Callable, Coroutine
from concurrent import futures
from typing import Any, TypeVar

CLOSED = "the loop is closed"

T = TypeVar("T")


class LoopThread(threading.Thread):
    """Runs from its creation until `close`, or until the program ends."""

    def __init__(self) -> None:
        super().__init__(name="iiwa-sim", daemon=True)
        # A factory, so that the loop of the calling thread stays as it is.
        self._runner = asyncio.Runner(loop_factory=asyncio.new_event_loop)
        self._loop = self._runner.get_loop()
        self._lock, self._closed, self._process = threading.Lock(), False, os.getpid()
        self.start()

    def run(self) -> None:
        with self._runner:
            self._loop.run_forever()

    @property
    def current(self) -> bool:
        """Return True if the caller runs in this thread."""
        return threading.current_thread() is self

    def wait_for(self, function: Callable[[], Coroutine[Any, Any, T]], limit_s: float | None = None) -> T:
        """Run a coroutine in the loop and wait for its result; what it raises is raised here.

        If the wait is interrupted, the coroutine is cancelled. Raises TimeoutError, which names what blocks
        the thread, after `limit_s`. Raises RuntimeError in this thread itself, where it would wait for ever,
        in a forked process, and if the loop is closed or closes meanwhile.
        """
        if os.getpid() != self._process:
            raise RuntimeError("the loop runs in the process that this one was forked from")
        if self.current:
            raise RuntimeError("the loop cannot wait for itself")
        with self._lock:
            if self._closed:
                raise RuntimeError(CLOSED)
            answer = asyncio.run_coroutine_threadsafe(function(), self._loop)
        try:
            if not futures.wait([answer], limit_s).done:
                line = traceback.extract_stack(sys._current_frames().get(self.ident or 0))[-1]
                busy = f"{line.filename}:{line.lineno} in {line.name}: {line.line}"
                raise TimeoutError(f"the thread {self.name} is blocked by {busy}")
            return answer.result()
        except futures.CancelledError:
            raise RuntimeError(CLOSED) from None
        except KeyboardInterrupt:
            answer.cancel()
            raise

    def close(self, *, wait: bool = True) -> None:
        """Cancel what runs in the loop, end the thread and wait for that.

        Without `wait` a blocked thread is left alone: it ends when it is free, or with the program.
        """
        with self._lock:
            if not self._closed:
                self._closed = True  # before the loop stops: pending coroutines start, and are cancelled
                self._loop.call_soon_threadsafe(self._loop.stop)
        if wait:
            self.join()
