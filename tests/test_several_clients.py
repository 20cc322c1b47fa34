"""Several clients of one robot, over real sockets: all at once, or one after the other."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator

import pytest

from iiwa_sim.client import Iiwa
from iiwa_sim.simulator import Simulator
from tests.processes import running
from tests.talking import DEADLINE_S, Client, until

NEAR = "joint move : 0.01 0.52 0 -1.04 0 1.57 0 " + " ".join(["1"] * 7)


@pytest.fixture
async def exclusive() -> AsyncIterator[Simulator]:
    async with Simulator(exclusive=True) as simulator:
        yield simulator


async def connect(simulator: Simulator) -> Client:
    """A client that the server knows of."""
    count = len(simulator._servers["iiwa"].connections)
    client = await Client.connect(simulator.port)
    await until(lambda: len(simulator._servers["iiwa"].connections) == count + 1)
    return client


async def some_ticks(simulator: Simulator, ticks: int = 20) -> None:
    """As a measure of time."""
    until_tick = simulator.controller.tick + ticks
    await until(lambda: simulator.controller.tick >= until_tick)


async def test_both_move_the_robot_in_the_order_in_which_their_commands_arrive(simulator: Simulator) -> None:
    one, two = await connect(simulator), await connect(simulator)
    assert await one.ask("joint move : 0.1 0.5 0 -1 0 1.5 0 " + "1 " * 7) == "done"
    assert await two.ask("joint move : 0.1 0.5 0 -1 0 1.5 0.1 " + "1 " * 7) == "done"
    assert await one.ask("get status") == await two.ask("get status") == "moving"
    assert await one.until_stopped() > 0
    assert await two.ask("get joint position") == "0.1 0.5 0.0 -1.0 0.0 1.5 0.1"
    await one.leaves()
    await two.leaves()


@pytest.mark.parametrize("how", ["leaves", "vanishes", "bye"])
async def test_a_second_client_waits_until_the_first_has_gone(exclusive: Simulator, how: str) -> None:
    first, second = await connect(exclusive), await connect(exclusive)
    second.send(b"hello\r\nget status\r\n" + NEAR.encode() + b"\r\n")
    await second.sent()
    for _ in range(20):
        assert await first.ask("get joint position") != ""
    await some_ticks(exclusive)
    assert second.unread == b"", "nothing is answered yet"
    assert await first.ask("get status") == "stopped", "and nothing moves yet"
    if how == "leaves":
        await first.leaves()
    elif how == "vanishes":
        first.vanishes()
    else:
        assert await first.ask("bye") == "bye"
    assert [await second.reply() for _ in range(3)] == ["hello", "stopped", "done"]
    await second.until_stopped()
    assert exclusive.controller.joints[0] == 0.01
    await second.leaves()
    await first.leaves()


async def test_a_client_that_waits_does_not_keep_the_simulator_from_ending() -> None:
    async with Simulator(exclusive=True) as simulator:
        first, second = await connect(simulator), await connect(simulator)
        second.send(b"hello\r\n")
        assert await first.ask("hello") == "hello"
    assert await first.rest() == b""
    with contextlib.suppress(ConnectionResetError):  # what it said was not read
        assert await second.rest() == b""
    await first.leaves()
    await second.leaves()


@pytest.mark.parametrize("exclusive", [False, True])
async def test_a_pause_before_the_next_client_is_served(exclusive: bool) -> None:
    pause_s = 0.1
    loop = asyncio.get_running_loop()
    async with Simulator(exclusive=exclusive, reconnect_pause_s=pause_s) as simulator:
        first = await connect(simulator)
        assert await first.ask("hello") == "hello", "the first one of all waits for nobody"
        over = loop.create_future()
        loop.call_later(pause_s, over.set_result, None)
        await first.leaves()
        await until(lambda: not simulator._servers["iiwa"].connections)
        next_one = await connect(simulator)
        assert await next_one.ask("hello") == "hello"
        assert over.done()
        await next_one.leaves()


def test_a_bye_ends_the_process_if_it_shall() -> None:
    with running("--bye-shuts-down", "--status-port", "0") as simulator:
        with Iiwa("127.0.0.1", simulator.port) as early:
            early.hello()
        with Iiwa("127.0.0.1", simulator.port) as robot:
            robot.joint_move((1, 1, 1, -1.5, 1, 1, 1), (0.1,) * 7)
            robot.bye()
            _, said = simulator.process.communicate(timeout=DEADLINE_S)
        assert (simulator.process.returncode, said) == (0, "")
