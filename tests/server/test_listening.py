"""Who connects while the system has no descriptor left."""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import socket

import pytest

from iiwa_sim.server import listening
from iiwa_sim.server.listening import Acceptor, as_protocol
from tests.talking import DEADLINE_S


class NoneLeft:
    """A listening socket at which there is no descriptor for the first so many who knock."""

    def __init__(self, real: socket.socket, failures: int) -> None:
        self._real = real
        self.failures = failures
        self.asked = 0

    def __getattr__(self, name: str) -> object:
        return getattr(self._real, name)

    def accept(self) -> object:
        self.asked += 1
        if self.failures:
            self.failures -= 1
            raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))
        return self._real.accept()


async def test_while_descriptors_are_used_up_it_asks_now_and_then_and_says_so_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(listening, "AGAIN_S", 0.001)
    opened: list[asyncio.Protocol] = []

    class Opened(asyncio.Protocol):
        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            opened.append(self)
            transport.close()  # type: ignore[attr-defined]

    real = socket.create_server(("127.0.0.1", 0))
    scarce = NoneLeft(real, 40)
    acceptor = Acceptor(scarce, as_protocol(Opened))  # type: ignore[arg-type]
    turns = 0
    async with asyncio.timeout(DEADLINE_S):
        connecting = asyncio.create_task(asyncio.open_connection(*acceptor.address))
        while not opened:
            turns += 1
            await asyncio.sleep(0)
    _, writer = await connecting
    writer.close()
    acceptor.close()
    assert scarce.asked <= 45, "now and then, and no more"
    assert turns > scarce.asked, "others have their turns between"
    (told,) = [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING]
    assert told == "nobody can connect for the time being: Too many open files"
