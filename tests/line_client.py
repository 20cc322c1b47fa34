"""A client over a real socket; every wait has a deadline."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
import time
from collections.abc import Callable
from typing import Self

DEADLINE_S = 60.0  # for operations of milliseconds: only a fault takes longer
PAUSE_S = 0.002  # between two checks of a condition in real time
TURNS = 1000  # of the loop before it waits in real time


class Client:
    """A driver on a socket of its own."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader = reader
        self._writer = writer

    @classmethod
    async def connect(cls, port: int, host: str = "127.0.0.1") -> Self:
        async with asyncio.timeout(DEADLINE_S):
            return cls(*await asyncio.open_connection(host, port))

    async def ask(self, command: str) -> str:
        """Send a command and return its reply."""
        self.send(command.encode() + b"\r\n")
        return await self.reply()

    def send(self, data: bytes) -> None:
        self._writer.write(data)

    async def sent(self) -> None:
        """Wait until the system has taken all sent bytes."""
        async with asyncio.timeout(DEADLINE_S):
            await self._writer.drain()

    async def reply(self) -> str:
        async with asyncio.timeout(DEADLINE_S):
            line = await self._reader.readuntil(b"\r\n")
        return line[:-2].decode()

    async def line(self) -> str:
        r"""Return a line that ends with `\n` only."""
        async with asyncio.timeout(DEADLINE_S):
            return (await self._reader.readuntil(b"\n"))[:-1].decode()

    async def moving(self) -> bool:
        return await self.ask("get status") == "moving"

    async def until_stopped(self) -> int:
        """Ask until the robot has stopped; return how often it was still moving."""
        asked = 0
        async with asyncio.timeout(DEADLINE_S):
            while await self.moving():
                asked += 1
                await asyncio.sleep(PAUSE_S)
        return asked

    async def rest(self) -> bytes:
        """Return all further bytes up to the end of the stream."""
        async with asyncio.timeout(DEADLINE_S):
            return await self._reader.read()

    @property
    def unread(self) -> bytes:
        """Bytes that have come and have not been read."""
        return bytes(self._reader._buffer)

    def sends_no_more(self) -> None:
        self._writer.write_eof()

    async def leaves(self) -> None:
        """Close the connection like a driver that ends in good order."""
        self._writer.close()
        with contextlib.suppress(ConnectionError):  # the server may have closed first
            await self._writer.wait_closed()

    def vanishes(self) -> None:
        """Reset the connection like a driver that crashed."""
        connection = self._writer.get_extra_info("socket")
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self._writer.transport.abort()


def wait_until(condition: Callable[[], bool]) -> None:
    """Wait until a condition holds that another thread or process changes."""
    end_s = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < end_s, "the condition does not hold in time"
        time.sleep(PAUSE_S)


async def until(condition: Callable[[], bool]) -> None:
    """Let the loop run until a condition holds."""
    async with asyncio.timeout(DEADLINE_S):
        turn = 0
        while not condition():
            turn += 1
            await asyncio.sleep(0 if turn < TURNS else PAUSE_S)
