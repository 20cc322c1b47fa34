"""A port that broadcasts lines: each connection gets the newest line, as often as it can take one."""

import contextlib
import logging
import socket
from collections import deque
from collections.abc import Callable
from math import ceil

from iiwa_sim.dialect.session import Session
from iiwa_sim.serve.budget import Budget
from iiwa_sim.serve.far_end import FarEnds, far_end
from iiwa_sim.serve.line_connection import SessionConnection
from iiwa_sim.serve.server import Server

RECEIVE_BYTES = 1024
"""Bytes read from a reader at once: small, so that a reader that floods is handled between ticks."""

UNREAD_MS = 60
"""A reader on this machine is sent no more while it has lines of this time unread: three at the usual rate.
The ten ticks at most that are made up for after a stall all reach it at 200 Hz and more."""
LOOKS_HZ = 50
"""Looks in a second, whether a reader that is sent no more reads again: one costs more than a line."""
SEND_BYTES = 4096
"""Size of the system's send buffer at the usual rate. A small buffer keeps lines recent for a slow reader;
Linux then holds about three lines. The receive buffer of a reader on another machine is out of our hands."""
MOST_SEND_BYTES = 16_384
"""Size of that buffer at high rates, where lines in flight count too and may be acknowledged 40 ms late."""

MIN_RATE_HZ = 1
MAX_RATE_HZ = 500
DEFAULT_RATE_HZ = 50

logger = logging.getLogger(__name__)


class StatusStream(Server["Reader"]):
    """Sends `line()` to every connection to `host`:`port`, `rate_hz` times per second of simulated time.

    Sending times are counted in ticks (`tick_rate_hz` per second), so lines show the same instants however
    the machine stalls. Where the rates are no multiples, intervals differ by one tick.

    One line is formatted for all readers. A reader that has not taken the last line skips this one, and so
    does a reader with `UNREAD_MS` of lines unread, as far as the system tells: the process holds the rest of
    one line per connection at most. A reader that has closed its sending side still gets lines.
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
        super().__init__(lambda: Reader(self), host, port, budget, receive_bytes=RECEIVE_BYTES)
        self.open_session = open_session
        self.on_reader = on_reader
        self.newest = b""
        self.far_ends = FarEnds()
        self.most_unread = ceil(rate_hz * UNREAD_MS / 1000)
        """Lines."""
        self.between_looks = max(1, rate_hz // LOOKS_HZ)
        """Lines that are due between two looks at a reader that lags."""
        self._line = line
        self._rate_hz = rate_hz
        self._tick_rate_hz = tick_rate_hz
        self.send_bytes = min(MOST_SEND_BYTES, max(SEND_BYTES, SEND_BYTES * rate_hz // DEFAULT_RATE_HZ))
        self._due = 0  # in units of 1 / tick_rate_hz of a line

    async def start(self) -> None:
        """Start listening. Raises ListenFault."""
        await super().start()
        self.far_ends.open()

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
        """Whether there are readers, who are sent lines in time."""
        return bool(self.connections)

    @property
    def has_commands(self) -> bool:
        """Always False: nothing that a reader sends makes the robot move."""
        return False

    async def close(self) -> None:
        """Stop listening and close every connection."""
        self.far_ends.close()
        await super().close()

    def _broadcast(self) -> None:
        ready = [reader for reader in self.connections if reader.ready and not reader.lags()]
        if ready:
            self.newest = self._line()
            for reader in ready:
                reader.offer()


class Reader(SessionConnection):
    """One connection to the status port."""

    _server: StatusStream

    def __init__(self, stream: StatusStream) -> None:
        super().__init__(stream, " (status)")
        self._offered = False  # a line waits to be sent
        self._before_line = b""
        self._sent_bytes = 0
        self._line_ends = deque[int]()  # of lines that may be unread still, in bytes sent
        self._next_look = 0  # lines that are due until then

    def _begin(self) -> None:
        connection = self._transport.get_extra_info("socket")
        with contextlib.suppress(OSError):  # already gone
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, self._server.send_bytes)
        self._far_end = far_end(connection)  # None where it cannot be asked about
        self._session = self._server.open_session(self._name)
        self._server.on_reader()
        self._tell_connected()

    def offer(self) -> None:
        """Note that a line is due; a reader that has to wait gets the newest line at its turn."""
        self._offered = True
        self._share.ask_later()

    @property
    def ready(self) -> bool:
        """Whether the system has taken all that was sent."""
        return not (self._transport.get_write_buffer_size() or self._transport.is_closing())

    def lags(self) -> bool:
        """Whether as many lines as may be are unread. The system is asked only where that is possible."""
        if self._far_end is None or len(self._line_ends) < self._server.most_unread:
            return False
        self._next_look -= 1
        if self._next_look > 0:
            return True
        read_bytes = self._server.far_ends.has_read(self._far_end)
        if read_bytes is None:
            self._far_end = None
            self._line_ends.clear()
            return False
        while self._line_ends and self._line_ends[0] <= read_bytes:
            self._line_ends.popleft()
        lags = len(self._line_ends) >= self._server.most_unread
        self._next_look = self._server.between_looks if lags else 0
        return lags

    def close(self) -> None:
        """Close at once: by FIN, or by a reset if a line has been sent in part."""
        if self.ready:
            self._transport.close()
        else:
            self._transport.abort()

    def _work(self, _until_s: float) -> bool:
        """Read what the reader has sent, and send the newest line."""
        if self._transport.is_closing():
            return False
        try:
            self._hand_on()
        except Exception as fault:  # noqa: BLE001  # told in the log
            self._drop(fault)
            return False
        if self._offered and self.ready:
            self._offered = False
            self._send(self._before_line + self._server.newest)
            self._before_line = b""
        if not self._sent_end:
            self._transport.resume_reading()
        return False

    def _send(self, line: bytes) -> None:
        self._transport.write(line)
        self._sent_bytes += len(line)
        if self._far_end is not None:
            self._line_ends.append(self._sent_bytes)

    def _hand_on(self) -> None:
        """Pass the received bytes on to the session; its replies are sent before the next line."""
        super()._hand_on()
        while self._session.waiting:
            self._before_line = self._session.answer() or self._before_line
