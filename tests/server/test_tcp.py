"""The TCP shell, with sessions that echo their lines."""

from __future__ import annotations

import asyncio
import socket
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress

import pytest

from iiwa_sim.server.listening import ListenFault, host_and_port
from iiwa_sim.server.tcp import Admission, TcpServer
from tests.talking import DEADLINE_S, Client, until


class EchoSession:
    """Answers every line with itself, `lines_at_once` at a time; `bye` closes."""

    def __init__(self, name: str, lines_at_once: int = 100, blow_up: int = 1) -> None:
        """A line that begins with # is repeated `blow_up` times in its reply."""
        self.name = name
        self.answered = 0
        self.times_lost = 0
        self.ended = False
        self.closing = False
        self.awaits = False
        self._lines_at_once = lines_at_once
        self._blow_up = blow_up
        self.waiting: deque[bytes] = deque()
        self._rest = b""

    def receive(self, data: bytes) -> None:
        *lines, self._rest = (self._rest + data).split(b"\n")
        self.waiting.extend(lines)

    def end(self) -> None:
        self.ended = True
        if self._rest:
            self.waiting.append(self._rest)

    def answer(self, most: int = 1_000_000) -> bytes:
        replies = []
        for _ in range(min(most, self._lines_at_once, len(self.waiting))):
            line = self.waiting.popleft().rstrip(b"\r")
            replies.append(line * (self._blow_up if line.startswith(b"#") else 1) + b"\r\n")
            self.answered += 1
            if line == b"bye":
                self.closing = True
                self.waiting.clear()
                break
        return b"".join(replies)

    def lost(self) -> None:
        self.times_lost += 1


class Served:
    """A server and the sessions it opened."""

    def __init__(
        self, open_session: Callable[[str], EchoSession], unread_s: float, admission: Admission | None
    ) -> None:
        self.sessions: list[EchoSession] = []
        self._open_session = open_session
        self._clients: list[Client] = []
        self._silent: list[socket.socket] = []
        self.server = TcpServer(self.open, "127.0.0.1", 0, unread_s=unread_s, admission=admission)

    def open(self, name: str) -> EchoSession:
        self.sessions.append(self._open_session(name))
        return self.sessions[-1]

    @property
    def port(self) -> int:
        return self.server.address[1]

    async def connect(self) -> Client:
        """A client, to be closed when the test is over."""
        self._clients.append(await Client.connect(self.port))
        return self._clients[-1]

    def connect_silently(self) -> socket.socket:
        """A client that reads only when it is told to, and a small buffer."""
        silent = socket.socket()
        self._silent.append(silent)
        silent.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        silent.connect(("127.0.0.1", self.port))
        silent.setblocking(False)
        return silent

    async def close(self) -> None:
        for silent in self._silent:
            silent.close()
        await self.server.close()
        for client in self._clients:
            await client.leaves()

    async def all_lost(self) -> None:
        await until(lambda: bool(self.sessions) and not self.server.connections)
        assert [session.times_lost for session in self.sessions] == [1] * len(self.sessions)


@asynccontextmanager
async def serving(
    open_session: Callable[[str], EchoSession] = EchoSession,
    unread_s: float = 1e3,
    admission: Admission | None = None,
) -> AsyncIterator[Served]:
    served = Served(open_session, unread_s, admission)
    await served.server.start()
    try:
        async with asyncio.timeout(DEADLINE_S):
            yield served
    finally:
        await served.close()


@pytest.mark.requirement("FRA101")
async def test_a_client_in_a_hurry_does_not_keep_others_waiting() -> None:
    async with serving(lambda name: EchoSession(name, lines_at_once=1)) as served:
        hurried, other = await served.connect(), await served.connect()
        await hurried.ask("there")
        await other.ask("there")
        backlog = 10_000
        hurried.send(b"x\n" * backlog)
        await until(lambda: served.sessions[0].answered > 100)
        for _ in range(10):
            assert await other.ask("and me?") == "and me?"
        assert served.sessions[0].answered < backlog
        for _ in range(backlog):
            assert await hurried.reply() == "x"


@pytest.mark.requirement("FRA101")
async def test_a_client_that_never_reads_is_dropped_and_others_are_served(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with serving(lambda name: EchoSession(name, blow_up=100), unread_s=0.5) as served:
        other = await served.connect()
        await other.ask("there")
        silent = served.connect_silently()
        request = b"#123456789\n" * 1000
        offered = 0
        most_held = 0
        while len(served.sessions) < 2 or not served.sessions[1].times_lost:
            with suppress(BlockingIOError, ConnectionError):
                offered += silent.send(request)
            assert await other.ask("still served?") == "still served?"
            held = [c._transport.get_write_buffer_size() for c in served.server.connections]
            most_held = max(most_held, *held)
        assert served.sessions[1].answered < offered // 11, "stopped answering before it was dropped"
        assert most_held < 64 * 1024 + 100 * 1002, "asyncio's high-water mark and one slice of replies"
        assert f"{served.sessions[1].name} dropped: left its replies unread for 0.5 s" in caplog.messages
        assert await other.ask("still served?") == "still served?"
        assert served.sessions[0].times_lost == 0


async def test_a_client_that_sends_no_more_still_gets_its_replies() -> None:
    async with serving() as served:
        client = await served.connect()
        client.send(b"1\n2\n" * 500 + b"no line end")
        client.sends_no_more()
        assert await client.rest() == b"1\r\n2\r\n" * 500 + b"no line end\r\n"
        assert served.sessions[0].ended
        await served.all_lost()


async def test_ipv6_is_served() -> None:
    if not socket.has_ipv6:
        pytest.skip("this machine has no IPv6")
    server = TcpServer(EchoSession, "::1", 0)
    await server.start()
    client = await Client.connect(server.address[1], "::1")
    assert await client.ask("there") == "there"
    await client.leaves()
    await server.close()
    assert host_and_port("::1", 0) == "[::1]:0"


@pytest.mark.parametrize(
    ("host", "port", "why"),
    [
        ("127.0.0.1", None, "Address already in use"),
        ("192.0.2.1", 0, "Cannot assign requested address"),  # an address kept for documentation
        ("a\nb\x1b[2J", 0, r"cannot listen on a\\nb\\x1b\[2J:0: "),
        ("", 0, "cannot listen on host '': expected an address or a host name, 0.0.0.0 for all"),
    ],
)
async def test_an_address_that_cannot_be_listened_on(host: str, port: int | None, why: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        server = TcpServer(EchoSession, host, port if port is not None else taken.getsockname()[1])
        with pytest.raises(ListenFault, match=why) as caught:
            await server.start()
        assert str(caught.value).isprintable()
        assert len(str(caught.value)) < 200


@pytest.mark.parametrize(
    "data",
    [
        b"POST /x?lin+move HTTP/1.1\r\nHost: a\r\n\r\nstop\r\n",
        b"GET / HTTP/1.1\r\n\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"GET /" + b"x" * 100_000 + b" HTTP/1.1\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\nstop\n",
    ],
)
@pytest.mark.parametrize("size", [3, 100_000])
async def test_nothing_of_what_browsers_send_is_a_command(
    data: bytes, size: int, caplog: pytest.LogCaptureFixture
) -> None:
    async with serving() as served:
        client = await served.connect()
        for begin in range(0, min(len(data), 3000), size):
            client.send(data[begin : begin + size])
            await asyncio.sleep(0)
        if size > 3000:
            client.send(data[3000:])
        with suppress(ConnectionError):
            assert await client.rest() == b""
        await served.all_lost()
        assert [session.answered for session in served.sessions] == [0]
    assert "as a web page would have it" in caplog.text
