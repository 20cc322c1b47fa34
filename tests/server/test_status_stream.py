"""The stream with sockets, ticked by hand: its line tells how often one was made."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from iiwa_sim.server.status_stream import StatusStream
from tests.talking import DEADLINE_S, Client, until


class Hearing:
    """Remembers what a reader said."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.heard = b""
        self.ended = False
        self.calls = 0
        self.waiting = False

    def receive(self, data: bytes) -> None:
        self.heard += data
        self.calls += 1
        if b"fault" in data:
            raise ZeroDivisionError("a fault of ours")
        self.waiting = b"?" in data

    def answer(self) -> bytes:
        answered = b"!" if self.waiting else b""
        self.waiting = False
        return answered

    def end(self) -> None:
        self.ended = True


class Streaming:
    """A stream whose lines are numbered."""

    def __init__(self, rate_hz: int, tick_rate_hz: int, line_bytes: int) -> None:
        self.made = 0
        self.line_bytes = line_bytes
        self.sessions: list[Hearing] = []
        self._sockets: list[socket.socket] = []
        self._clients: list[Client] = []
        self.stream = StatusStream(
            self.line, self.open, "127.0.0.1", 0, rate_hz=rate_hz, tick_rate_hz=tick_rate_hz
        )

    def line(self) -> bytes:
        self.made += 1
        return b"%d" % self.made + b" " * self.line_bytes + b"\n"

    def open(self, name: str) -> Hearing:
        self.sessions.append(Hearing(name))
        return self.sessions[-1]

    async def next_line(self) -> None:
        """As many ticks as that takes; the reader is sent it, too."""
        made = self.made
        while self.made == made:
            self.stream.tick()
        await asyncio.sleep(0)

    async def connect(self) -> Client:
        """A reader that is served."""
        count = len(self.stream.connections)
        self._clients.append(await Client.connect(self.stream.address[1]))
        await until(lambda: len(self.stream.connections) == count + 1)
        return self._clients[-1]

    async def connect_silently(self) -> socket.socket:
        """A reader that reads only when it is told to, and a small buffer."""
        count = len(self.stream.connections)
        silent = socket.socket()
        self._sockets.append(silent)
        silent.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        silent.connect(self.stream.address)
        silent.setblocking(False)
        await until(lambda: len(self.stream.connections) == count + 1)
        return silent

    def held(self) -> int:
        """Bytes that wait in the process, for all readers together."""
        return sum(reader._transport.get_write_buffer_size() for reader in self.stream.connections)

    async def close(self) -> None:
        await self.stream.close()
        for silent in self._sockets:
            silent.close()
        for client in self._clients:
            await client.leaves()


@asynccontextmanager
async def streaming(
    rate_hz: int = 50, tick_rate_hz: int = 500, line_bytes: int = 1000
) -> AsyncIterator[Streaming]:
    streaming = Streaming(rate_hz, tick_rate_hz, line_bytes)
    await streaming.stream.start()
    try:
        async with asyncio.timeout(DEADLINE_S):
            yield streaming
    finally:
        await streaming.close()


async def number(client: Client) -> int:
    """Number of the next line."""
    return int(await client.line())


@pytest.mark.requirement("FRA201")
@pytest.mark.parametrize(("rate_hz", "tick_rate_hz"), [(1, 100), (60, 500), (500, 500)])
async def test_lines_come_at_their_rate_of_ticks(rate_hz: int, tick_rate_hz: int) -> None:
    async with streaming(rate_hz, tick_rate_hz, 0) as served:
        reader = await served.connect()
        gaps, since = [], 0
        for _ in range(3 * tick_rate_hz):
            before = served.made
            served.stream.tick()
            since += 1
            if served.made > before:
                gaps.append(since)
                since = 0
                assert await number(reader) == served.made
        assert served.made == 3 * rate_hz
        assert since == 0
        assert max(gaps) - min(gaps) <= 1


@pytest.mark.requirement("FRA201")
async def test_all_readers_get_the_same_line_which_is_made_once() -> None:
    async with streaming() as served:
        readers = [await served.connect() for _ in range(5)]
        for k in range(1, 21):
            for _ in range(10):
                served.stream.tick()
            assert [await number(reader) for reader in readers] == [k] * 5
        assert served.made == 20


@pytest.mark.requirement("FRA201")
async def test_a_stuck_reader_misses_lines_and_delays_nobody() -> None:
    async with streaming(500) as served:
        reader, stuck = await served.connect(), await served.connect_silently()
        for _ in range(1500):
            served.stream.tick()
            assert await number(reader) == served.made
            assert served.held() < 1010, "the rest of one line at most"
        assert served.made == 1500
        assert served.held() > 0
        numbers, rest = [], b""
        while not numbers or numbers[-1] <= 1500:
            served.stream.tick()  # what has been missed comes no more, but the newest line does
            await number(reader)
            rest += await asyncio.get_running_loop().sock_recv(stuck, 1 << 16)
            *lines, rest = rest.split(b"\n")
            numbers += [int(line) for line in lines]
        assert numbers == sorted(set(numbers)), "lines are whole and in order"
        assert len([each for each in numbers if each <= 1500]) < 100, "the system holds little of the past"


async def test_a_line_that_is_larger_than_all_buffers_arrives_whole() -> None:
    async with streaming(500, line_bytes=1_000_000) as served:
        reader = await served.connect_silently()
        for k in (1, 2, 3):
            served.stream.tick()
            await until(lambda: bool(served.held()))
            for _ in range(10):
                served.stream.tick()  # no other line is made while that one is under way
            assert served.made == k
            received = b""
            while not received.endswith(b"\n"):
                received += await asyncio.get_running_loop().sock_recv(reader, 1 << 16)
            assert received.split() == [b"%d" % k]
            await until(lambda: not served.held())


@pytest.mark.requirement("FRA202")
async def test_what_readers_say_is_heard_each_on_its_own() -> None:
    async with streaming() as served:
        one, two = await served.connect(), await served.connect()
        one.send(b"stop\n")
        two.send(b"x" * 5000)
        one.sends_no_more()
        await until(lambda: served.sessions[0].ended and len(served.sessions[1].heard) == 5000)
        assert served.sessions[0].heard == b"stop\n"
        assert served.sessions[0].name != served.sessions[1].name
        assert served.sessions[1].calls >= 3, "a flood is heard in portions"


async def test_what_a_session_answers_comes_before_the_next_line_and_once() -> None:
    async with streaming(500) as served:
        reader = await served.connect()
        reader.send(b"?")
        await until(lambda: served.sessions[0].heard == b"?")
        served.stream.tick()
        assert (await reader.line()).split() == ["!1"]
        served.stream.tick()
        assert await number(reader) == 2


@pytest.mark.parametrize("how", ["leaves", "vanishes"])
async def test_readers_come_and_go(how: str, caplog: pytest.LogCaptureFixture) -> None:
    async with streaming(500) as served:
        stays = await served.connect()
        for k in range(1, 11):
            goes = await served.connect()
            served.stream.tick()
            assert await number(goes) == await number(stays) == k
            if how == "leaves":
                await goes.leaves()
            else:
                goes.vanishes()
            before = served.made
            async with asyncio.timeout(DEADLINE_S):
                while len(served.stream.connections) > 1:
                    served.stream.tick()
                    assert await number(stays) == served.made
            served.made = k
            assert before == k
    assert [record for record in caplog.records if record.levelno >= logging.WARNING] == []


async def test_a_fault_in_a_session_costs_that_reader_only(caplog: pytest.LogCaptureFixture) -> None:
    async with streaming(500) as served:
        other, reader = await served.connect(), await served.connect()
        reader.send(b"fault\n")
        await until(lambda: len(served.stream.connections) == 1)
        served.stream.tick()
        assert await number(other) == 1
        assert "ZeroDivisionError" in caplog.text


async def test_closing_ends_every_connection_stuck_ones_too() -> None:
    async with streaming(500) as served:
        reader, _ = await served.connect(), await served.connect_silently()
        address = served.stream.address
        while not served.held():
            served.stream.tick()
            await number(reader)
        await served.stream.close()
        assert await reader.rest() == b""
        assert not served.stream.connections
        with pytest.raises(ConnectionRefusedError):
            await Client.connect(address[1])
        served.stream.tick()
        await served.stream.close()


@pytest.mark.parametrize(
    ("rate_hz", "tick_rate_hz", "told"),
    [
        (501, 1000, "expected 1 to 500"),
        (200, 100, "expected 1 to 100, one line per tick"),
    ],
)
def test_a_rate_out_of_range_is_refused(rate_hz: int, tick_rate_hz: int, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        Streaming(rate_hz, tick_rate_hz, 0)
