"""Connections while the system has no free descriptor."""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import socket

import pytest

from iiwa_sim.server import listening
from iiwa_sim.server.listening import Acceptor
from tests.line_client import DEADLINE_S


class ScarceListener:
    """A listening socket without a descriptor for the first so many connections."""

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


async def test_without_free_descriptors_the_server_retries_and_logs_it(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    scarce = ScarceListener(socket.create_server(("127.0.0.1", 0)), 3)
    served = asyncio.Event()

    async def opened(*_: object) -> ScarceListener:
        return scarce

    async def serve(connection: socket.socket, _peer: object) -> None:
        connection.close()
        served.set()

    monkeypatch.setattr(listening, "AGAIN_S", 0.001)
    monkeypatch.setattr(listening, "open_listener", opened)
    acceptor = Acceptor("", 0, serve)
    await acceptor.start()
    async with asyncio.timeout(DEADLINE_S):
        _, writer = await asyncio.open_connection(*acceptor.address)
        await served.wait()
    writer.close()
    acceptor.close()
    assert scarce.asked <= 6, "now and then, and no more"
    warnings = [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING]
    assert warnings == ["no client can connect for the time being: Too many open files"] * 3
