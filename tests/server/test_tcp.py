"""The TCP shell, with sessions that echo their lines."""

from __future__ import annotations

import asyncio
import logging
import random
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress

import pytest

from iiwa_sim.server.listening import ListenFault, host_and_port
from iiwa_sim.server.tcp import LONGEST_PAUSE_S, Admission, TcpServer
from tests.server.line_sessions import EchoSession
from tests.talking import DEADLINE_S, Client, until


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


@pytest.mark.requirement("FRA003", "FRA004")
async def test_lines_split_anywhere_are_answered_in_order() -> None:
    dice = random.Random(1)
    lines = [f"line {n}" for n in range(2_000)]
    data = "".join(f"{line}\r\n" for line in lines).encode()
    async with serving() as served:
        client = await served.connect()
        while data:
            cut = dice.choice([1, 2, 7, 100, 3000, 100_000])
            client.send(data[:cut])
            await client.sent()
            data = data[cut:]
        assert [await client.reply() for _ in lines] == lines


async def test_small_replies_are_not_held_back() -> None:
    async with serving() as served:
        client = await served.connect()
        await client.ask("there")
        (connection,) = served.server.connections
        own_end = connection._transport.get_extra_info("socket")
        assert own_end.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
        assert own_end.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)


@pytest.mark.requirement("FRA101")
async def test_a_client_in_a_hurry_does_not_keep_others_waiting() -> None:
    async with serving(lambda name: EchoSession(name, lines_at_once=1)) as served:
        hurried, other = await served.connect(), await served.connect()
        await hurried.ask("there")
        await other.ask("there")
        backlog = 50_000
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


async def test_a_client_that_reads_late_gets_every_reply() -> None:
    count = 5_000
    async with serving(lambda name: EchoSession(name, blow_up=100)) as served:
        late = served.connect_silently()
        request = b"".join(b"#%09d\n" % n for n in range(count))
        await until(lambda: bool(served.sessions))
        loop = asyncio.get_running_loop()
        sending = loop.create_task(loop.sock_sendall(late, request))
        (connection,) = served.server.connections
        await until(lambda: connection._unread is not None)
        answered = served.sessions[0].answered
        for _ in range(100):
            await asyncio.sleep(0)
        assert served.sessions[0].answered == answered, "no line is answered while replies pile up"
        expected = b"".join(b"#%09d" % n * 100 + b"\r\n" for n in range(count))
        received = bytearray()
        while len(received) < len(expected):
            received += await loop.sock_recv(late, 1 << 16)
        assert received == expected
        await sending


@pytest.mark.parametrize("lines_at_once", [1, 100])
async def test_a_client_that_sends_no_more_still_gets_its_replies(lines_at_once: int) -> None:
    async with serving(lambda name: EchoSession(name, lines_at_once)) as served:
        client = await served.connect()
        client.send(b"1\n2\n" * 500 + b"no line end")
        client.sends_no_more()
        assert await client.rest() == b"1\r\n2\r\n" * 500 + b"no line end\r\n"
        assert served.sessions[0].ended
        await served.all_lost()


async def test_after_bye_the_connection_closes_and_what_follows_is_not_answered() -> None:
    async with serving() as served:
        client = await served.connect()
        client.send(b"a\r\nbye\r\nb\r\n")
        assert await client.rest() == b"a\r\nbye\r\n"
        await served.all_lost()


@pytest.mark.parametrize("how", ["leaves", "vanishes"])
async def test_a_session_learns_once_that_its_client_has_gone(how: str) -> None:
    async with serving() as served:
        client = await served.connect()
        await client.ask("there")
        if how == "leaves":
            await client.leaves()
        else:
            client.vanishes()
        await served.all_lost()


async def test_a_fault_in_a_session_costs_that_connection_only(caplog: pytest.LogCaptureFixture) -> None:
    async with serving(lambda name: EchoSession(name, lines_at_once=2)) as served:
        other = await served.connect()
        await other.ask("there")
        client = await served.connect()
        client.send(b"1\n2\n3\nfault\n")
        await until(lambda: served.sessions[1].times_lost == 1)
        (fault,) = [record for record in caplog.records if record.levelno >= logging.ERROR]
        assert fault.exc_info is not None
        assert fault.exc_info[0] is ZeroDivisionError
        assert await other.ask("still served?") == "still served?"


async def test_a_closing_server_ends_every_connection() -> None:
    async with serving(lambda name: EchoSession(name, blow_up=1000)) as served:
        silent = served.connect_silently()
        await asyncio.get_running_loop().sock_sendall(silent, b"#123456789\n" * 500)
        clients = [await served.connect() for _ in range(20)]
        for client in clients:
            await client.ask("there")
        port = served.port
        await served.server.close()
        await served.all_lost()
        for client in clients:
            assert await client.rest() == b""
        with pytest.raises(ConnectionRefusedError):
            await Client.connect(port)


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


async def test_one_client_is_served_after_the_other_in_their_order() -> None:
    async with serving(admission=Admission(exclusive=True)) as served:
        clients = []
        for k in range(4):
            clients.append(await served.connect())
            clients[-1].send(b"there\n")
            await until(lambda k=k: len(served.sessions) == k + 1)
        assert await clients[0].reply() == "there"
        await clients[2].leaves()
        for k in (1, 3):
            assert clients[k].unread == b""
            await clients[k - 1 if k == 1 else 1].leaves()
            assert await clients[k].reply() == "there"


@pytest.mark.parametrize("exclusive", [False, True])
async def test_a_pause_after_the_last_client_has_gone(exclusive: bool) -> None:
    loop, pause_s = asyncio.get_running_loop(), 0.1
    async with serving(admission=Admission(exclusive, pause_s)) as served:
        first = await served.connect()
        await first.ask("there")
        begun_s = loop.time()
        await first.leaves()
        await until(lambda: not served.server.connections)
        assert await (await served.connect()).ask("there") == "there"
        assert loop.time() - begun_s >= pause_s


async def test_nobodys_turn_comes_after_the_close() -> None:
    async with serving(admission=Admission(exclusive=True)) as served:
        await (await served.connect()).ask("there")
        late = await served.connect()
        late.send(b"there\n")
        await until(lambda: len(served.sessions) == 2)
        await served.server.close()
        with suppress(ConnectionError):
            assert await late.rest() == b""
        assert served.sessions[1].answered == 0


@pytest.mark.parametrize("pause_s", [-1e-9, float("nan"), LONGEST_PAUSE_S + 1])
def test_a_pause_out_of_range_is_refused(pause_s: float) -> None:
    with pytest.raises(ValueError, match="expected 0 to 86400 s"):
        Admission(pause_s=pause_s)


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
@pytest.mark.parametrize("size", [1, 3, 100_000])
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


@pytest.mark.parametrize("cut", [1, 4, 100])
@pytest.mark.parametrize(
    "data",
    [
        b"get status\n",
        b"GET STATUS :\nGET / HTTP/1.1\n",
        b"\xff\xfd\x06\n",
        b"x" * 5000 + b"\n",
        b"\x16\n",
        b"hello",
    ],
)
async def test_what_only_looks_like_that_is_passed_on_whole(data: bytes, cut: int) -> None:
    async with serving() as served:
        client = await served.connect()
        client.send(data[:cut])
        await until(lambda: bool(served.sessions))
        client.send(data[cut:])
        client.sends_no_more()
        assert await client.rest() == data.replace(b"\n", b"\r\n") + b"\r\n" * (not data.endswith(b"\n"))
