"""The TCP server of a simulator: clients in a hurry, clients that never read, browsers, addresses."""

from __future__ import annotations

import asyncio
import socket
import time
from contextlib import suppress

import pytest

from iiwa_sim.server import tcp
from iiwa_sim.server.budget import PIECE_S, Budget
from iiwa_sim.server.listening import ListenFault, host_and_port, open_listener
from iiwa_sim.server.tcp import TcpServer
from iiwa_sim.simulator import Simulator
from tests.line_client import DEADLINE_S, Client, until


def server_of(simulator: Simulator) -> TcpServer:
    (robot,) = simulator.robots.values()
    return robot.servers["iiwa"]


@pytest.mark.requirement("FRA101")
async def test_a_fast_client_does_not_delay_others(simulator: Simulator) -> None:
    hurried, other = await Client.connect(simulator.port), await Client.connect(simulator.port)
    backlog = 20_000
    hurried.send(b"get joint position\n" * backlog)
    await hurried.reply()
    for _ in range(10):
        assert await other.ask("get status") == "stopped"
    assert hurried.unread.count(b"\n") < backlog - 1
    for _ in range(backlog - 1):
        await hurried.reply()
    await hurried.leaves()
    await other.leaves()


async def test_connections_work_in_turns_of_short_pieces_with_ticks_before_each() -> None:
    done: list[str] = []
    budget = Budget(first=lambda: done.append("ticks"))

    def has_more(name: str, pieces: int, until_s: float) -> bool:
        assert until_s <= time.monotonic() + PIECE_S
        done.append(name)
        return done.count(name) < pieces

    assert budget.ask(lambda until_s: has_more("a", 3, until_s))
    assert budget.ask(lambda until_s: has_more("b", 2, until_s))
    await until(lambda: len(done) == 10)
    assert done == ["ticks", "a", "ticks", "b", "ticks", "a", "ticks", "b", "ticks", "a"]


@pytest.mark.requirement("FRA101")
async def test_a_client_that_never_reads_is_dropped_and_others_are_served(
    simulator: Simulator, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    server = server_of(simulator)
    monkeypatch.setattr(tcp, "UNREAD_S", 0.5)
    other = await Client.connect(simulator.port)
    await other.ask("hello")
    with socket.socket() as silent:
        silent.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        silent.connect(("127.0.0.1", simulator.port))
        silent.setblocking(False)
        most_held = 0
        async with asyncio.timeout(DEADLINE_S):
            while "left its replies unread for 0.5 s" not in caplog.text:
                with suppress(BlockingIOError, ConnectionError):
                    silent.send(b"help\n" * 1000)
                assert await other.ask("hello") == "hello"
                most_held = max(c.transport.get_write_buffer_size() for c in server.connections)
        assert most_held < 64 * 1024 + 100_000, "asyncio's high-water mark and one slice of replies"
    assert await other.ask("hello") == "hello"
    await other.leaves()


async def test_a_client_that_sends_no_more_still_gets_its_replies(simulator: Simulator) -> None:
    client = await Client.connect(simulator.port)
    client.send(b"hello\nget status\n" * 500 + b"get mode")
    client.sends_no_more()
    assert await client.rest() == b"hello\r\nstopped\r\n" * 500 + b"unknown\r\n"
    await until(lambda: not server_of(simulator).connections)
    await client.leaves()


async def test_ipv6_is_served() -> None:
    if not socket.has_ipv6:
        pytest.skip("this machine has no IPv6")
    async with Simulator(host="::1") as simulator:
        client = await Client.connect(simulator.port, "::1")
        assert await client.ask("hello") == "hello"
        await client.leaves()
    assert host_and_port("::1", 0) == "[::1]:0"


@pytest.mark.parametrize(
    ("host", "port", "why"),
    [
        ("127.0.0.1", None, "Address already in use, by a program or another option; port 0, such as"),
        ("192.0.2.1", 0, "Cannot assign requested address"),  # an address kept for documentation
        ("a\nb\x1b[2J", 0, r"cannot listen on a\\nb\\x1b\[2J:0: "),
    ],
)
async def test_an_unusable_address(host: str, port: int | None, why: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        where = port if port is not None else taken.getsockname()[1]
        with pytest.raises(ListenFault, match=why) as caught:
            await open_listener(host, where)
        assert str(caught.value).isprintable()
        assert len(str(caught.value)) < 200


@pytest.mark.parametrize(
    "data",
    [
        b"POST /x?lin+move HTTP/1.1\r\nHost: a\r\n\r\nset override : 0.5\r\n",
        b"GET / HTTP/1.1\r\n\r\nset override : 0.5\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"GET /" + b"x" * 100_000 + b" HTTP/1.1\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\nset override : 0.5\n",
    ],
)
async def test_requests_of_browsers_are_never_commands(
    simulator: Simulator, data: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    client = await Client.connect(simulator.port)
    client.send(data)
    with suppress(ConnectionError):
        assert await client.rest() == b""
    assert simulator.controller.override == 1.0
    assert simulator.state().error.code == 0
    assert "as a web page would have it" in caplog.text
    await client.leaves()
