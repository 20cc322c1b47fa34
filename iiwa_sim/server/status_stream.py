"""A port that broadcasts lines: each connection gets the newest line, as often as it can take one."""

import contextlib
import socket
from collections.abc import Callable

from iiwa_sim.protocols.session import Session
from iiwa_sim.server.budget import Budget
from iiwa_sim.server.connection import Connection, Server

RECEIVE_BYTES = 1024
"""Bytes read from a reader at once: small, so that a reader that floods is handled between ticks."""

SEND_BYTES = 4096
"""Size of the system's send buffer at the usual rate. A small buffer keeps lines recent for a slow reader;
Linux then holds about three lines. The receive buffer of the reader is out of our hands."""
MOST_SEND_BYTES = 16_384
"""Size of that buffer at high rates, where lines in flight count too and may be acknowledged 40 ms late."""

MIN_RATE_HZ = 1
MAX_RATE_HZ = 500
DEFAULT_RATE_HZ = 50


class StatusStream(Server["Reader"]):
    """Sends `line()` to every connection to `host`:`port`, `rate_hz` times per second of simulated time.

    Sending times are counted in ticks (`tick_rate_hz` per second), so lines show the same instants however
    the machine stalls. Where the rates are no multiples, intervals differ by one tick.

    One line is formatted for all readers. A reader that has not taken the last line skips this one: the
    process holds the rest of one line per connection at most. A reader that has closed its sending side still
    gets lines.
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
        on_reader: Callable[[], None] = lambda: None,
        budget: Budget | None = None,
    ) -> None:
        """`on_reader` is called before a reader is added. `budget` may be shared with other servers.

        Raises ValueError for a rate outside 1 to 500 Hz or above the tick rate.
        """
        most_hz = min(MAX_RATE_HZ, tick_rate_hz)
        if not MIN_RATE_HZ <= rate_hz <= most_hz:
            ticks = f", one line per tick at {tick_rate_hz} Hz" if most_hz == tick_rate_hz else ""
            raise ValueError(f"status_rate_hz is {rate_hz}, expected {MIN_RATE_HZ} to {most_hz}{ticks}")
        super().__init__(lambda: Reader(self), open_session, host, port, budget, RECEIVE_BYTES)
        self.on_reader = on_reader
        self.newest = b""
        self._line = line
        self._rate_hz = rate_hz
        self._tick_rate_hz = tick_rate_hz
        self.send_bytes = min(MOST_SEND_BYTES, max(SEND_BYTES, SEND_BYTES * rate_hz // DEFAULT_RATE_HZ))
        self._due = 0  # in units of 1 / tick_rate_hz of a line

    def tick(self) -> None:
        """Notice that a tick has been made; send a line if one is due."""
        self._due += self._rate_hz
        if self._due >= self._tick_rate_hz:
            self._due -= self._tick_rate_hz
            self._broadcast()

    def skip(self, ticks: int) -> None:
        """The robot has made `ticks` ticks while there was no reader."""
        self._due = (self._due + ticks * self._rate_hz) % self._tick_rate_hz

    @property
    def watching(self) -> bool:
        """Return True if there are readers, who are sent lines in time."""
        return bool(self.connections)

    @property
    def has_commands(self) -> bool:
        """Always False: nothing that a reader sends makes the robot move."""
        return False

    def _broadcast(self) -> None:
        ready = [reader for reader in self.connections if reader.ready]
        if ready:
            self.newest = self._line()
            for reader in ready:
                reader.offer()


class Reader(Connection):
    """One connection to the status port."""

    _server: StatusStream

    def __init__(self, stream: StatusStream) -> None:
        super().__init__(stream, " (status)")
        self._offered = False  # a line waits to be sent
        self._before_line = b""

    def offer(self) -> None:
        """Note that a line is due; a reader that has to wait gets the newest line at its turn."""
        self._offered = True
        self._share.ask_later()

    @property
    def ready(self) -> bool:
        """True if the system has taken all that was sent."""
        return not (self._transport.get_write_buffer_size() or self._transport.is_closing())

    def close(self) -> None:
        """Close at once: by FIN, or by a reset if a line has been sent in part."""
        if self.ready:
            self._transport.close()
        else:
            self._transport.abort()

    def _begin(self) -> None:
        connection = self._transport.get_extra_info("socket")
        with contextlib.suppress(OSError):  # already gone
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, self._server.send_bytes)
        self._server.on_reader()

    def _answer(self, _until_s: float) -> bool:
        """Send the newest line, behind what the session answers to what the reader has sent."""
        while self._session.waiting:
            self._before_line = self._session.answer() or self._before_line
        if self._offered and self.ready:
            self._offered = False
            self._transport.write(self._before_line + self._server.newest)
            self._before_line = b""
        if not self._sent_end:
            self._transport.resume_reading()
        return False
