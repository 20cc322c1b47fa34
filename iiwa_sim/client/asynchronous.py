"""A connection to a server in any of the protocols, inside an asyncio loop."""

import asyncio
import time
from types import TracebackType
from typing import Generic, Self, TypeVar

from iiwa_sim.client.blocking import POLL_PERIOD_S, RECEIVE_BYTES
from iiwa_sim.client.errors import CommandError
from iiwa_sim.client.exchange import CLOSED, Answer, Language, Request, Said

T = TypeVar("T")


class AsyncConnection(Generic[Said, Answer]):
    """One connection for the tasks of one loop, with the exceptions of `Connection`.

    It connects when its context is entered, or by `reconnect()`. Tasks ask one after the other; a task that
    is cancelled while it waits for its answer closes the connection.
    """

    _language: Language[Said, Answer]

    def __init__(self, host: str, port: int, timeout_s: float = 5.0) -> None:
        """`timeout_s` bounds the time to connect and the wait for each reply."""
        self._address = (host, port)
        self._timeout_s = timeout_s
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None
        self._turn = asyncio.Lock()

    async def __aenter__(self) -> Self:
        await self.reconnect()
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    async def reconnect(self) -> None:
        """Open a new connection in place of the present one, closed or not. Raises OSError."""
        self.close()
        self._conversation = self._language.conversation()
        async with asyncio.timeout(self._timeout_s):
            self._streams = await asyncio.open_connection(*self._address)

    def close(self) -> None:
        """End the connection. A robot that still carries out a move of this client stops."""
        if self._streams is not None:
            self._streams[1].close()
            self._streams = None

    async def wait_until_stopped(self, timeout_s: float) -> None:
        """Return when the robot is at rest; after `timeout_s` raises TimeoutError and keeps the
        connection."""
        deadline = time.monotonic() + timeout_s
        while not await self._do(self._language.at_rest):
            if time.monotonic() > deadline:
                raise TimeoutError(f"the robot still moves after {timeout_s} s")
            await asyncio.sleep(POLL_PERIOD_S)

    async def _do(self, asked: Request[Said, Answer, T]) -> T:
        async with self._turn:
            if self._streams is None:
                raise ConnectionError(CLOSED)
            try:
                return asked.result(await self._ask(*self._streams, asked.said))
            except CommandError:
                raise
            except BaseException:
                self.close()
                raise

    async def _ask(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, said: Said) -> Answer:
        try:
            async with asyncio.timeout(self._timeout_s):
                writer.write(self._conversation.say(said))
                await writer.drain()
                while (answer := self._conversation.hear(await reader.read(RECEIVE_BYTES))) is None:
                    pass
        except TimeoutError:
            raise TimeoutError(f"no answer to {said!r} within {self._timeout_s} s") from None
        return answer
