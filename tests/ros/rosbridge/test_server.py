"""The WebSocket server of rosbridge, with a session of a few words."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable

import pytest
from websockets.asyncio.client import connect

from iiwa_sim.ros.rosbridge.outbox import Outbox
from iiwa_sim.ros.rosbridge.server import RosbridgeServer
from iiwa_sim.server.budget import Budget
from iiwa_sim.server.web_access import WebAccess
from tests.talking import DEADLINE_S


class Counting:
    """Answers each message with five, and publishes five more."""

    closing = False

    def __init__(self, outbox: Outbox) -> None:
        self._outbox = outbox
        outbox.set_feed("/results", 0.0, 1000)

    def receive(self, text: bytes) -> None:
        for number in range(5):
            self._outbox.reply(f"{text.decode()} {number}")
        for number in range(5):
            self._outbox.feed("/results", f"result {number}".format)

    def end(self) -> None:
        pass


async def test_all_that_waits_is_sent_also_where_there_is_time_for_one_message_at_once() -> None:
    """As on a machine that does something else in the midst of a piece of work."""

    def open_session(_name: str, wake: Callable[[], None]) -> tuple[Counting, Outbox]:
        outbox = Outbox(wake)
        return Counting(outbox), outbox

    in_a_hurry = Budget(now_s=lambda: 0.0)  # each piece should have ended long ago
    server = RosbridgeServer(open_session, "127.0.0.1", 0, lambda: None, in_a_hurry, WebAccess())
    await server.start()
    async with asyncio.timeout(DEADLINE_S), connect("ws://{}:{}".format(*server.address)) as client:
        for word in ("one", "two"):
            await client.send(word)
            heard = [await client.recv() for _ in range(10)]
            assert heard == [f"{word} {k}" for k in range(5)] + [f"result {k}" for k in range(5)]
    await server.close()


OPENING = (
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)


@pytest.mark.parametrize(
    ("said", "status", "told"),
    [
        (OPENING.replace(b"Host: 127.0.0.1", b"Host: evil.example"), b"403", "the host 'evil.example'"),
        (b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", b"426", "Connection"),
        (b"hello\r\n", None, "HTTP request line"),
    ],
)
async def test_what_opens_no_websocket_is_refused_in_one_line(
    said: bytes, status: bytes | None, told: str, caplog: pytest.LogCaptureFixture
) -> None:

    def open_session(_name: str, _wake: Callable[[], None]) -> tuple[Counting, Outbox]:
        raise AssertionError("no session should be opened")

    server = RosbridgeServer(open_session, "127.0.0.1", 0, lambda: None, Budget(), WebAccess())
    await server.start()
    async with asyncio.timeout(DEADLINE_S):
        reader, writer = await asyncio.open_connection(*server.address)
        writer.write(said)
        answer = await reader.read()
        writer.close()
    await server.close()
    assert answer.split()[1:2] == ([] if status is None else [status])
    assert len(caplog.records) == 1, caplog.text
    assert re.search(f"refused: .*({told})", caplog.text)
    assert "Traceback" not in caplog.text


async def test_frames_right_behind_the_opening_are_heard() -> None:
    def open_session(_name: str, wake: Callable[[], None]) -> tuple[Counting, Outbox]:
        outbox = Outbox(wake)
        return Counting(outbox), outbox

    server = RosbridgeServer(open_session, "127.0.0.1", 0, lambda: None, Budget(), WebAccess())
    await server.start()
    async with asyncio.timeout(DEADLINE_S):
        reader, writer = await asyncio.open_connection(*server.address)
        writer.write(OPENING + b"\x81\x83\0\0\0\0one")
        assert b" 101 " in await reader.readuntil(b"\r\n\r\n")
        assert await reader.readexactly(7) == b"\x81\x05one 0"
        writer.close()
    await server.close()
