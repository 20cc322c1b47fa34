"""A loop in a thread of its own, and who waits for it."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Iterator

import pytest

from iiwa_sim.loop_thread import LoopThread
from tests.talking import DEADLINE_S


@pytest.fixture
def loop() -> Iterator[LoopThread]:
    loop = LoopThread("test")
    yield loop
    loop.close()


async def thread() -> threading.Thread:
    return threading.current_thread()


def test_a_coroutine_runs_in_the_thread(loop: LoopThread) -> None:
    ran_in = loop.wait_for(thread)
    assert ran_in is not threading.current_thread()
    assert ran_in.daemon
    assert not loop.current
    loop.close()
    assert not ran_in.is_alive()


def test_what_it_raises_is_raised_where_one_waits(loop: LoopThread) -> None:
    async def fails() -> None:
        raise ZeroDivisionError("on purpose")

    with pytest.raises(ZeroDivisionError, match="on purpose"):
        loop.wait_for(fails)
    assert loop.wait_for(thread).is_alive()


def test_the_loop_cannot_wait_for_itself(loop: LoopThread) -> None:
    async def waits() -> None:
        loop.wait_for(thread)

    with pytest.raises(RuntimeError, match="cannot wait for itself"):
        loop.wait_for(waits)


def test_who_waits_learns_that_the_loop_is_closed(loop: LoopThread) -> None:
    begun, told = threading.Event(), list[str]()

    async def for_ever() -> None:
        begun.set()
        await asyncio.Event().wait()

    def wait() -> None:
        try:
            loop.wait_for(for_ever)
        except RuntimeError as fault:
            told.append(str(fault))

    waiting = threading.Thread(target=wait)
    waiting.start()
    assert begun.wait(DEADLINE_S)
    loop.close()
    waiting.join(DEADLINE_S)
    assert told == ["the loop is closed"]
    with pytest.raises(RuntimeError, match="the loop is closed"):
        loop.wait_for(thread)
    loop.close()


def call_until_closed(loop: LoopThread) -> None:
    with contextlib.suppress(RuntimeError):
        while True:
            loop.wait_for(thread)


def test_closing_while_many_threads_call_lets_none_of_them_wait() -> None:
    for _ in range(20):
        loop = LoopThread("test")

        callers = [threading.Thread(target=call_until_closed, args=(loop,)) for _ in range(4)]
        for caller in callers:
            caller.start()
        loop.wait_for(thread)
        loop.close()
        for caller in callers:
            caller.join(DEADLINE_S)
            assert not caller.is_alive()
