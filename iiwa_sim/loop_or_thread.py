"""A context that runs in the caller's asyncio loop, or in a loop of its own in a thread."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Coroutine
from types import TracebackType
from typing import Any, Self, TypeVar

from iiwa_sim.loop_thread import LoopThread

LEAVE_S = 10.0
"""Seconds that the thread has to leave the context before it counts as blocked."""
RUNNING = "the simulator runs already"

T = TypeVar("T")


class LoopOrThread(ABC):
    """Entered by `async with` in the caller's loop, or by `with`, which starts a thread. One at a time."""

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
        """Whether the context is entered, in either way."""

    @abstractmethod
    def _catch_up(self) -> None:
        """Something is about to be called: what is in the loop has to be as of now."""

    @abstractmethod
    def _commanded(self) -> None:
        """Called after a function has run in the loop, which may have changed something there."""

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
        """The result of `function`, called between two ticks in the robot's thread; raises what it raises.

        Raises TimeoutError, naming what blocks the thread, if that takes more than `limit_s`. If the thread
        has ended, or there is none, the function is called at once.
        """

        async def called() -> T:
            return self._called(function)

        if self._thread is None or self._thread.current:
            return self._called(function)
        return self._thread.wait_for(called, limit_s)

    def _wait_for(self, coroutine: Callable[[], Coroutine[Any, Any, T]]) -> T:
        """The result of a coroutine, or what it raises. Raises RuntimeError if there is no thread."""
        if self._thread is None:
            raise RuntimeError("only within `with Simulator(...)`; in a loop, await the methods of `clock`")
        return self._thread.wait_for(coroutine)

    def _called(self, function: Callable[[], T]) -> T:
        self._catch_up()
        try:
            return function()
        finally:
            self._commanded()

    def _leave(self, thread: LoopThread) -> None:
        async def leave() -> None:
            await self.__aexit__(None, None, None)

        blocked = False
        try:
            if not thread.elsewhere:  # a forked child that leaves would end its parent's robot
                thread.wait_for(leave, LEAVE_S)
        except TimeoutError:
            blocked = True
            raise
        finally:
            thread.close(wait=not blocked)
            self._thread = None
