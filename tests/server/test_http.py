"""The HTTP port: real sockets, requests cut anywhere, clients that misbehave."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest

from iiwa_sim.server import http
from iiwa_sim.server.http import (
    LONGEST_BODY,
    LONGEST_HEAD,
    HttpAnswer,
    HttpRequest,
    HttpServer,
)
from tests.talking import DEADLINE_S, Client, until

POST = b"POST /echo?x=1 HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\n\r\nhello"
GET = b"GET /echo HTTP/1.1\r\nHost: a\r\n\r\n"
LARGE = b"x" * 8_000_000  # more than the system takes for a client that does not read


class Echo:
    """Answers with what was asked, or with much; /slow when told, /broken never."""

    def __init__(self) -> None:
        self.requests: list[HttpRequest] = []
        self.go = asyncio.Event()
        self.cancelled = 0

    def answer(self, request: HttpRequest) -> HttpAnswer | asyncio.Task[HttpAnswer]:
        self.requests.append(request)
        if request.path == "/slow":
            return asyncio.get_running_loop().create_task(self._slow())
        if request.path == "/broken":
            raise ZeroDivisionError
        if request.path == "/large":
            return HttpAnswer(200, LARGE, "text/plain")
        return HttpAnswer(200, f"{request.method} {request.path} ".encode() + request.body, "text/plain")

    async def _slow(self) -> HttpAnswer:
        try:
            await self.go.wait()
        except asyncio.CancelledError:
            self.cancelled += 1
            raise
        return HttpAnswer(200, b"slow", "text/plain")


@pytest.fixture
async def echo() -> Echo:
    return Echo()


@pytest.fixture
async def server(echo: Echo) -> AsyncIterator[HttpServer]:
    server = HttpServer(echo.answer, "127.0.0.1", 0)
    await server.start()
    yield server
    await server.close()
    assert not server.connections


class Clients:
    """Clients of a test, which leave at its end."""

    def __init__(self) -> None:
        self.there: list[Client] = []

    async def __call__(self, server: HttpServer) -> Client:
        self.there.append(await Client.connect(server.address[1]))
        return self.there[-1]


@pytest.fixture
async def connected() -> AsyncIterator[Clients]:
    clients = Clients()
    yield clients
    for client in clients.there:
        await client.leaves()

        await client.leaves()


async def answer(client: Client) -> tuple[int, dict[str, str], bytes]:
    """The next answer: status, headers, body."""
    status = int((await client.reply()).split(" ")[1])
    headers = {}
    while line := await client.reply():
        name, _, value = line.partition(": ")
        headers[name.lower()] = value
    async with asyncio.timeout(DEADLINE_S):
        body = await client._reader.readexactly(int(headers.get("content-length", "0")))
    return status, headers, body


async def test_a_connection_serves_several_requests_also_sent_at_once(
    connected: Clients, server: HttpServer, echo: Echo
) -> None:
    client = await connected(server)
    for _ in range(2):
        client.send(POST)
        status, headers, body = await answer(client)
        assert (status, body) == (200, b"POST /echo hello")
        assert headers["cache-control"] == "no-store"
    client.send(POST + GET + POST)
    assert [(await answer(client))[2] for _ in range(3)] == [
        b"POST /echo hello",
        b"GET /echo ",
        b"POST /echo hello",
    ]
    assert echo.requests[0].all("host") == ["a"]


async def test_a_request_may_be_cut_anywhere(connected: Clients, server: HttpServer) -> None:
    client = await connected(server)
    for byte in POST:
        client.send(bytes([byte]))
        await client.sent()
        await asyncio.sleep(0)
    assert (await answer(client))[2] == b"POST /echo hello"


async def test_who_sends_no_more_is_answered_and_closed(connected: Clients, server: HttpServer) -> None:
    client = await connected(server)
    client.send(GET)
    client.sends_no_more()
    assert (await client.rest()).endswith(b"GET /echo ")


@pytest.mark.parametrize(
    ("sent", "status"),
    [
        (b"hello\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\nHost: a\r\nContent-Length: -1\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\nHost: a\r\nX: " + b"x" * (2 * LONGEST_HEAD), 431),
        (b"POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 70000\r\n\r\n" + b"x" * (LONGEST_BODY + 1), 413),
        (b"GET /broken HTTP/1.1\r\nHost: a\r\n\r\n", None),
        (b"\x16\x03\x01", 400),
    ],
)
async def test_what_is_wrong_ends_its_connection_and_no_other(
    connected: Clients, server: HttpServer, sent: bytes, status: int | None
) -> None:
    client, other = await connected(server), await connected(server)
    client.send(sent)
    client.sends_no_more()
    rest = await client.rest()
    assert rest.startswith(b"HTTP/1.1 %d" % status) if status is not None else rest == b""
    other.send(GET)
    assert (await answer(other))[0] == 200


async def test_what_takes_its_time_keeps_its_place_and_nobody_else(
    connected: Clients, server: HttpServer, echo: Echo
) -> None:
    slow, other = await connected(server), await connected(server)
    slow.send(GET.replace(b"/echo", b"/slow") + GET)
    await until(lambda: len(echo.requests) == 1)
    other.send(GET)
    assert (await answer(other))[2] == b"GET /echo "
    assert len(echo.requests) == 2
    echo.go.set()
    assert [(await answer(slow))[2] for _ in range(2)] == [b"slow", b"GET /echo "]


async def test_who_goes_ends_what_takes_its_time(connected: Clients, server: HttpServer, echo: Echo) -> None:
    client = await connected(server)
    client.send(GET.replace(b"/echo", b"/slow"))
    await until(lambda: len(echo.requests) == 1)
    client.vanishes()
    await until(lambda: echo.cancelled == 1)


async def test_who_never_ends_a_request_is_dropped(
    connected: Clients, server: HttpServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(http, "IDLE_S", 0.05)
    client = await connected(server)
    client.send(GET[:-3])
    async with asyncio.timeout(DEADLINE_S):
        with pytest.raises((ConnectionError, asyncio.IncompleteReadError)):
            await client.reply()
