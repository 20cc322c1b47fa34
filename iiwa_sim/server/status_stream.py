"""A port that broadcasts lines: each connection gets the newest line, as often as it can take one."""

from collections.abc import Callable
from functools import cache

from iiwa_sim.protocols.session import Session
from iiwa_sim.server.budget import Budget
from iiwa_sim.server.tcp import TcpServer

SEND_BYTES = 16_384
"""Size of the system's send buffer: lines stay recent for a slow reader, and those in flight at 500 Hz fit,
which may be acknowledged 40 ms late."""

MIN_RATE_HZ = 1
MAX_RATE_HZ = 500
DEFAULT_RATE_HZ = 50


class StatusStream(TcpServer):
    """Sends `line()` to every connection to `host`:`port`, `rate_hz` times per second of simulated time.

    Sending times are counted in ticks, of which there are `tick_rate_hz` per second. A reader that has not
    taken the last line skips this one. A reader that has closed its sending side still gets lines.
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
        super().__init__(
            open_session,
            host,
            port,
            budget=budget,
            on_client=on_reader,
            suffix=" (status)",
            send_bytes=SEND_BYTES,
            lasting=True,
        )
        self._line = line
        self._rate_hz = rate_hz
        self._tick_rate_hz = tick_rate_hz
        self._due = 0  # in units of 1 / tick_rate_hz of a line

    def tick(self) -> None:
        """Notice that a tick has been made; send a line if one is due."""
        self._due += self._rate_hz
        if self._due >= self._tick_rate_hz:
            self._due -= self._tick_rate_hz
            line = cache(self._line)  # formatted once for all readers, if any can take it
            for reader in self.connections:
                reader.offer(line)

    def skip(self, ticks: int) -> None:
        """Notice that the robot has made `ticks` ticks while there was no reader."""
        self._due = (self._due + ticks * self._rate_hz) % self._tick_rate_hz

    @property
    def watching(self) -> bool:
        """Return True if there are readers, who are sent lines in time."""
        return bool(self.connections)

    @property
    def has_commands(self) -> bool:
        """Always False: nothing that a reader sends makes the robot move."""
        return False
