"""A port that broadcasts lines: each connection gets the newest line when it can take one."""

from collections.abc import Callable
from functools import cache
from typing import Any

from iiwa_sim.server.tcp import TcpServer

SEND_BYTES = 16_384
"""Size of the system's send buffer: small, so that lines stay recent for a slow reader.
It holds the lines in flight at 500 Hz, which may be acknowledged 40 ms late."""


class StatusStream(TcpServer):
    """Server that sends `line()` to every connection to `host`:`port`, `rate_hz` times per simulated second.

    Sending times are counted in ticks, of which there are `tick_rate_hz` per second. A reader that has not
    taken the last line skips this one. A reader that has closed its sending side still gets lines.
    """

    has_commands = False  # nothing that a reader sends makes the robot move

    def __init__(self, line: Callable[[], bytes], tick_rate_hz: int, rate_hz: int, **server: Any) -> None:
        super().__init__(suffix=" (status)", send_bytes=SEND_BYTES, lasting=True, **server)
        self._line, self._tick_rate_hz, self._rate_hz = line, tick_rate_hz, rate_hz
        self._due = 0  # in units of 1 / tick_rate_hz of a line

    def tick(self) -> None:
        """Notice that a tick has been made; send a line if one is due."""
        self._due += self._rate_hz
        if self._due >= self._tick_rate_hz:
            self._due -= self._tick_rate_hz
            line = cache(self._line)  # formatted once for all readers, if any can take it
            for reader in self.connections:
                reader.offer(line)

    @property
    def watching(self) -> bool:
        """Return True if there are readers, which get lines in time."""
        return bool(self.connections)
