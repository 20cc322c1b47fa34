"""A port that broadcasts lines: each connection gets the newest one, as often as it can take one."""

import asyncio
import contextlib
import logging
import socket
from collections.abc import Callable

from iiwa_sim.dialect.session import Session
from iiwa_sim.serve.budget import Budget
from iiwa_sim.serve.first_line import FirstLine, FromBrowserFault
from iiwa_sim.serve.listening import Acceptor, listen, peer_of, why

RECEIVE_BYTES = 1024
"""Taken from a reader at once: what it says in a hurry is heard in small portions, with ticks in between."""

SEND_BYTES = 4096
"""What the system is asked to hold for a reader at the usual rate: the less, the newer is what a slow one
gets next. Linux then holds some three lines. What the reader's own system holds is not ours."""
MOST_SEND_BYTES = 16_384
"""The same at high rates: lines on their way are held, too, and may be acknowledged 40 ms late."""

MIN_RATE_HZ = 1
MAX_RATE_HZ = 500
DEFAULT_RATE_HZ = 50

logger = logging.getLogger(__name__)


class StatusStream:
    """Sends `line()` to every connection to `host`:`port`, `rate_hz` times in a second of ticks.

    Counted in ticks, of which there are `tick_rate_hz` in a second: so a line shows the same instants however
    the machine stalls. Where the rates are not multiples, lines are a tick nearer or farther apart.

    A line is made once, for all who can take it. Who has not yet taken the last one goes without this one:
    the process holds the rest of one line per connection at most, and waits for nobody. A reader that sends
    no more is still sent lines.
    """

    def __init__(
        self,
        line: Callable[[], bytes],
        open_session: Callable[[str], Session],
        host: str,
        port: int,
        *,
        rate_hz: int = DEFAULT_RATE_HZ,
        tick_rate_hz: int,
        budget: Budget | None = None,
    ) -> None:
        """`budget` is shared with other servers of the loop.

        Raises ValueError for a rate outside 1 to 500 Hz or beyond that of the ticks.
        """
        most_hz = min(MAX_RATE_HZ, tick_rate_hz)
        if not MIN_RATE_HZ <= rate_hz <= most_hz:
            ticks = f", one line per tick at {tick_rate_hz} Hz" if most_hz == tick_rate_hz else ""
            raise ValueError(f"status_rate_hz is {rate_hz}, expected {MIN_RATE_HZ} to {most_hz}{ticks}")
        self.open_session = open_session
        self.budget = budget or Budget()
        self.buffer = memoryview(bytearray(RECEIVE_BYTES))  # of all readers: it is emptied at once
        self.newest = b""
        self.readers: set[Reader] = set()
        self._line = line
        self._rate_hz = rate_hz
        self._tick_rate_hz = tick_rate_hz
        self.send_bytes = min(MOST_SEND_BYTES, max(SEND_BYTES, SEND_BYTES * rate_hz // DEFAULT_RATE_HZ))
        self._due = 0  # in parts of 1 / tick_rate_hz of a line
        self._asked = (host, port)
        self._acceptor: Acceptor | None = None

    async def start(self) -> None:
        """Listen. Raises ListenFault."""
        self._acceptor = await listen(lambda: Reader(self), *self._asked)

    @property
    def listening(self) -> bool:
        return self._acceptor is not None

    @property
    def address(self) -> tuple[str, int]:
        """Host and port listened on. Raises RuntimeError before `start` and after `close`."""
        if self._acceptor is None:
            raise RuntimeError("the stream does not listen")
        return self._acceptor.address

    def tick(self) -> None:
        """A tick has been made: send a line if one is due."""
        self._due += self._rate_hz
        if self._due >= self._tick_rate_hz:
            self._due -= self._tick_rate_hz
            self._broadcast()

    async def close(self) -> None:
        """Listen no more and close every connection."""
        if self._acceptor is None:
            return
        self._acceptor.close()
        self._acceptor = None
        gone = [reader.gone for reader in self.readers]
        for reader in list(self.readers):
            reader.close()
        if gone:
            await asyncio.wait(gone)

    def _broadcast(self) -> None:
        ready = [reader for reader in self.readers if reader.ready]
        if ready:
            self.newest = self._line()
            for reader in ready:
                reader.offer()


class Reader(asyncio.BufferedProtocol):
    """One connection to the status port."""

    _transport: asyncio.Transport
    gone: asyncio.Future[None]
    """Done once the connection is."""

    def __init__(self, stream: StatusStream) -> None:
        self._stream = stream
        self._share = stream.budget.share(self._work)
        self._first_line = FirstLine()
        self._received = b""  # and not handed to the session yet
        self._sent_end = False
        self._told_end = False  # the session knows
        self._offered = False  # a line, and it has not been sent yet
        self._before_line = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self.gone = asyncio.get_running_loop().create_future()
        self._name = f"{peer_of(transport)} (status)"
        self._mark = {"fields": {"session": self._name}}
        with contextlib.suppress(OSError):  # already gone
            connection = transport.get_extra_info("socket")
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, self._stream.send_bytes)
        self._session = self._stream.open_session(self._name)
        self._stream.readers.add(self)
        logger.info("%s connected", self._name, extra=self._mark)
        if not self._stream.listening:  # accepted while the stream closed
            self.close()

    def get_buffer(self, _sizehint: int) -> memoryview:
        return self._stream.buffer

    def buffer_updated(self, nbytes: int) -> None:
        self._received += self._stream.buffer[:nbytes]
        if self._share.waits:
            self._transport.pause_reading()
        else:
            self._share.ask()

    def eof_received(self) -> bool:
        self._sent_end = True
        self._share.ask()
        return True  # the transport stays open for the lines

    def offer(self) -> None:
        """There is a line to be sent; who has to wait for that gets the one that is the newest then."""
        self._offered = True
        self._share.ask_later()

    def connection_lost(self, exc: Exception | None) -> None:
        self._share.leave()
        self._stream.readers.discard(self)
        self.gone.set_result(None)
        logger.info("%s disconnected%s", self._name, f": {why(exc)}" if exc else "", extra=self._mark)

    @property
    def ready(self) -> bool:
        """Whether all that was sent has been taken by the system."""
        return not (self._transport.get_write_buffer_size() or self._transport.is_closing())

    def close(self) -> None:
        """Close at once, in good order unless a line has been sent in part."""
        if self.ready:
            self._transport.close()
        else:
            self._transport.abort()

    def _work(self, _until_s: float) -> bool:
        """Hear what has been said, and send the newest line; that is short."""
        if self._transport.is_closing():
            return False
        try:
            self._hand_on()
        except FromBrowserFault as fault:
            logger.warning(
                "%s closed: it sent %s, as a web page would have it", self._name, fault, extra=self._mark
            )
            self._transport.abort()
            return False
        except Exception:
            logger.exception("%s dropped: internal fault", self._name, extra=self._mark)
            self._transport.abort()
            return False
        if self._offered and self.ready:
            self._offered = False
            self._transport.write(self._before_line + self._stream.newest)
            self._before_line = b""
        if not self._sent_end:
            self._transport.resume_reading()
        return False

    def _hand_on(self) -> None:
        """To the session, what has been received."""
        data, self._received = self._received, b""
        first = self._first_line
        if data:
            self._hear(data if first.passed else first.take(data))
        if self._sent_end and not self._told_end:
            self._told_end = True
            if not first.passed:
                self._hear(first.rest())
            self._session.end()
            self._session.answer()

    def _hear(self, data: bytes) -> None:
        """Hand on to the session; what it replies is sent before the next line."""
        self._session.receive(data)
        while self._session.waiting:
            self._before_line = self._session.answer() or self._before_line
