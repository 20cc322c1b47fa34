"""The timer of the clock, in a real loop."""

import asyncio
import socket
import time

from iiwa_sim.timer import AT_ONCE, open_timer

SOON_NS = 5_000_000


def test_it_calls_for_the_instant_that_was_set_last_and_once() -> None:
    async def calls(*instants_ns: int) -> int:
        called = 0

        def wake() -> None:
            nonlocal called
            called += 1

        timer = open_timer(wake)
        begun_ns = time.monotonic_ns()
        for each in instants_ns:
            timer.wake_at(each if each == AT_ONCE else begun_ns + each)
        await asyncio.sleep(4e-9 * SOON_NS)
        timer.close()
        return called

    far_ns = 10**15
    assert asyncio.run(calls(AT_ONCE)) == 1
    assert asyncio.run(calls(AT_ONCE, AT_ONCE)) == 1
    assert asyncio.run(calls(SOON_NS)) == 1
    assert asyncio.run(calls(SOON_NS, AT_ONCE)) == 1
    assert asyncio.run(calls(AT_ONCE, SOON_NS)) == 1
    assert asyncio.run(calls(AT_ONCE, far_ns)) == 0
    assert asyncio.run(calls(SOON_NS, far_ns)) == 0


def test_who_is_called_at_once_again_and_again_leaves_others_their_turn() -> None:
    async def heard() -> bytes:
        def wake() -> None:
            timer.wake_at(AT_ONCE)

        timer, loop = open_timer(wake), asyncio.get_running_loop()
        timer.wake_at(AT_ONCE)
        here, there = socket.socketpair()
        with here, there:
            here.setblocking(False)
            there.send(b"x")
            got = await loop.sock_recv(here, 1)
        timer.close()
        return got

    assert asyncio.run(heard()) == b"x"


def test_what_has_come_in_is_read_before_who_is_called_at_once() -> None:
    async def order() -> list[str]:
        seen: list[str] = []
        called = asyncio.Event()

        def wake() -> None:
            seen.append("called")
            called.set()

        timer, loop = open_timer(wake), asyncio.get_running_loop()
        here, there = socket.socketpair()
        with here, there:
            loop.add_reader(here, lambda: (seen.append("read"), loop.remove_reader(here)))
            there.send(b"x")
            timer.wake_at(AT_ONCE)
            await called.wait()
        timer.close()
        return seen

    assert asyncio.run(order()) == ["read", "called"]
