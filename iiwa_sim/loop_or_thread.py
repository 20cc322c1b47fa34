"""An async context that can be entered without await, too: it then has a loop in a thread of its own."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Coroutine
from types import TracebackType
from typing import Any, Self, TypeVar

from iiwa_sim.loop_thread import LoopThread

LEAVE_S = 10.0
"""So long a thread has for leaving the context, before it counts as blocked."""
RUNNING = "the simulator runs already"

T = TypeVar("T")


class LoopOrThread(ABC):
    """One at a time: `async with` in the caller's loop, or `with` and a thread."""

    def __init__(self, name: str) -> None:
        """`name` is that of the thread."""
        self._thread_name = name
        self._thread: LoopThread | None = None

    @abstractmethod
    async def __aenter__(self) -> Self: ...

    @abstractmethod
    async def __aexit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, where: TracebackType | None
    ) -> None: ...

    @property
    @abstractmethod
    def _runs(self) -> bool:
        """Whether the context has been entered, in whichever way."""

    @abstractmethod
    def _heed(self) -> None:
        """Something has been called that may have changed what is in the loop."""

    def __enter__(self) -> Self:
        if self._thread is not None or self._runs:
            raise RuntimeError(RUNNING)
        self._thread = LoopThread(self._thread_name)
        try:
            return self._thread.wait_for(self.__aenter__)
        except BaseException:
            self._leave(self._thread)
            raise

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, where: TracebackType | None
    ) -> None:
        if self._thread is not None:
            self._leave(self._thread)

    def call(self, function: Callable[[], T], limit_s: float | None = None) -> T:
        """What `function` gives, or raises, called between two ticks in the robot's thread.

        Raises TimeoutError where that takes more than `limit_s`, and names what blocks the thread. Where that
        has ended, or there is none, the function is called at once.
        """

        async def called() -> T:
            return self._called(function)

        if self._thread is None or self._thread.current:
            return self._called(function)
        return self._thread.wait_for(called, limit_s)

    def _wait_for(self, coroutine: Callable[[], Coroutine[Any, Any, T]]) -> T:
        """What it gives, or raises. Raises RuntimeError where there is no thread."""
        if self._thread is None:
            raise RuntimeError("only within `with Simulator(...)`; in a loop, await the methods of `clock`")
        return self._thread.wait_for(coroutine)

    def _called(self, function: Callable[[], T]) -> T:
        try:
            return function()
        finally:
            self._heed()

    def _leave(self, thread: LoopThread) -> None:
        async def leave() -> None:
            await self.__aexit__(None, None, None)

        blocked = False
        try:
            if not thread.elsewhere:  # or a child that leaves would end its parent's robot
                thread.wait_for(leave, LEAVE_S)
        except TimeoutError:
            blocked = True
            raise
        finally:
            thread.close(wait=not blocked)
            self._thread = None
