"""Faults on the wire over real sockets, in each protocol, and in each beside the other."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack

import pytest

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.protocols.faults import (
    CloseAfter,
    CloseBefore,
    Delay,
    Fault,
    Pass,
    ResetBefore,
    Silence,
)
from iiwa_sim.simulator import Simulator
from tests.drivers import ONE_OF_EACH_PROTOCOL, SCENES, Driver, Scene, connect
from tests.line_client import DEADLINE_S, Client, until

LATE_S = 0.05
A_WHILE = 5  # answers to another client, as a measure of time


class Bench:
    """A simulator, its backdoor, a driver, and another client."""

    def __init__(self, scene: Scene, simulator: Simulator, open_until_the_end: AsyncExitStack) -> None:
        self.scene, self.simulator = scene, simulator
        self._stack = open_until_the_end

    async def open(self) -> None:
        self.driver, self.number = await self.connects(self.scene.spoken)
        self.other, _ = await self.connects(self.scene.other)

    async def connects(self, protocol: str) -> tuple[Driver, int]:
        driver, number = await connect(self.simulator, protocol)
        self._stack.push_async_callback(driver.leaves)
        return driver, number

    @property
    def backdoor(self) -> Backdoor:
        return self.simulator.backdoor

    async def a_while(self) -> None:
        """Check that the other client is answered, and let some time pass."""
        for _ in range(A_WHILE):
            self.other.send(b"".join(self.other.QUESTIONS))
            assert [await self.other.whole_reply() for _ in range(3)] == list(self.other.ANSWERS)


@pytest.fixture(params=ONE_OF_EACH_PROTOCOL)
async def bench(request: pytest.FixtureRequest) -> AsyncIterator[Bench]:
    scene = SCENES[request.param]
    async with scene.simulator() as simulator, AsyncExitStack() as stack:
        bench = Bench(scene, simulator, stack)
        await bench.open()
        yield bench


def three(driver: Driver) -> bytes:
    return b"".join(driver.QUESTIONS)


async def some(driver: Driver, count: int) -> list[bytes]:
    return [await driver.whole_reply() for _ in range(count)]


async def test_late_replies_come_in_their_order(bench: Bench) -> None:
    driver, loop = bench.driver, asyncio.get_running_loop()
    bench.backdoor.set_fault(Delay(LATE_S), bench.number, 2)
    began = loop.time()
    driver.send(three(driver))
    await bench.a_while()
    if loop.time() - began < LATE_S:
        assert driver.unread == b"", "those behind a late one wait for it"
    assert await driver.whole_reply() == driver.ANSWERS[0]
    assert loop.time() - began >= LATE_S
    assert await some(driver, 2) == list(driver.ANSWERS[1:])
    assert loop.time() - began >= 2 * LATE_S
    await driver.is_served()


@pytest.mark.parametrize(
    ("fault", "replies", "broken"),
    [(CloseBefore(), 1, False), (CloseAfter(), 2, False), (ResetBefore(), 1, True)],
)
async def test_a_connection_that_ends_at_a_reply(
    bench: Bench, fault: Fault, replies: int, broken: bool
) -> None:
    driver = bench.driver
    bench.backdoor.set_fault(Pass(), bench.number, 1)
    bench.backdoor.set_fault(fault, bench.number)
    driver.send(b"".join(driver.QUESTIONS[:2]) + driver.SWITCH_ON)
    if broken:
        with pytest.raises(ConnectionResetError):
            await driver.rest()
    else:
        assert await driver.rest() == b"".join(driver.ANSWERS[:replies])
    await bench.a_while()
    assert not any(bench.simulator.state().outputs), "what is behind it is not carried out"
    again, _ = await bench.connects(bench.scene.spoken)
    await again.is_served()


@pytest.mark.parametrize("reset", [False, True])
async def test_a_connection_that_ends_now_stops_its_move(bench: Bench, reset: bool) -> None:
    home = bench.simulator.joints
    bench.backdoor.set_override(0.2)
    assert await bench.driver.moves(bench.scene.far) == 0
    await until(lambda: bench.simulator.joints != home)
    bench.backdoor.close_connections(bench.number, reset)
    if reset:
        with pytest.raises(ConnectionResetError):
            await bench.driver.rest()
    else:
        assert await bench.driver.rest() == b""
    await bench.other.until_stopped()
    assert bench.simulator.joints != pytest.approx(bench.scene.far, abs=0.1)


async def test_withheld_replies_are_sent_when_faults_are_cleared(bench: Bench) -> None:
    driver = bench.driver
    bench.backdoor.set_fault(Silence(), bench.number)
    driver.send(three(driver) + driver.SWITCH_ON)
    await bench.a_while()
    assert driver.unread == b""
    assert not any(bench.simulator.state().outputs), "nor is it carried out"
    driver.sends_no_more()
    await bench.a_while()
    bench.backdoor.clear_faults()
    assert (await driver.rest()).startswith(b"".join(driver.ANSWERS))
    assert bench.simulator.state().outputs[0]


async def test_refused_connections_and_accepted_ones(bench: Bench) -> None:
    ports = bench.simulator.ports
    assert list(ports) == list(bench.scene.protocols)
    for _ in range(2):
        bench.backdoor.refuse_connections()
        bench.backdoor.refuse_connections()
        for port in ports.values():
            with pytest.raises(ConnectionRefusedError):
                await Client.connect(port)
        assert bench.simulator.ports == ports
        await bench.driver.is_served()
        bench.backdoor.refuse_connections(False)
        for protocol in ports:
            again, number = await bench.connects(protocol)
            await again.is_served()
            await again.leaves()
            await until(lambda gone=number: gone not in bench.simulator.backdoor.connections())


def test_existing_connections_are_served_while_new_ones_are_refused() -> None:
    with Simulator() as simulator:
        for _ in range(10):
            with socket.create_connection((simulator.host, simulator.port), DEADLINE_S) as client:
                simulator.backdoor.refuse_connections()
                client.sendall(b"hello\n")
                assert client.recv(100) == b"hello\r\n"
            simulator.backdoor.refuse_connections(False)
