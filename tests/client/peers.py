"""The other end of a client, and async clients as if they were blocking."""

from __future__ import annotations

import asyncio
import contextlib
import inspect
import socket
import threading
from collections.abc import Callable
from typing import Any

from iiwa_sim.client import AsyncIiwa, AsyncKrc4
from tests.talking import DEADLINE_S

Answer = Callable[[bytes], bytes]


class Peer:
    """One connection's other end: `answer` turns what it hears into what it says; b"" ends the connection."""

    def __init__(self, answer: Answer) -> None:
        self.heard = b""
        self._answer = answer
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        connection, _ = self._listener.accept()
        with connection, contextlib.suppress(ConnectionError):
            while data := connection.recv(65536):
                self.heard += data
                reply = self._answer(data)
                if not reply:
                    return
                connection.sendall(reply)

    def close(self) -> None:
        """Once the client is closed."""
        self._thread.join(DEADLINE_S)
        assert not self._thread.is_alive()
        self._listener.close()


class Awaited:
    """An async client whose methods are called without await, each call running its loop."""

    def __init__(self, make: Callable[[], AsyncIiwa | AsyncKrc4]) -> None:
        self._runner = asyncio.Runner()
        self._client = make()

    def __getattr__(self, name: str) -> Any:
        method = getattr(self._client, name)

        def call(*arguments: Any, **named: Any) -> Any:
            async def run() -> Any:
                result = method(*arguments, **named)
                return await result if inspect.isawaitable(result) else result

            return self._runner.run(run())

        return call

    def let_go(self) -> None:
        """Closes the connection and the loop."""
        self.close()
        self._runner.run(asyncio.sleep(0))
        self._runner.close()


def be_impatient(client: Any, timeout_s: float = 0.05) -> None:
    """A client that is connected waits no longer than this for a reply; to connect may have taken longer."""
    getattr(client, "_client", client)._timeout_s = timeout_s
