"""Socket options of a client's connection."""

import contextlib
import socket
import struct
import sys

SEND_BYTES = 131_072
"""Size of the system's send buffer. When it is full, replies wait in asyncio's buffer of up to 64 KiB, and
then commands wait."""

_RESET_AT_CLOSE = struct.pack("ii", 1, 0)  # struct linger: no time for what is not sent yet


UNREAD_MS = 30_000
"""Time (ms) for which sent data may stay unacknowledged or unread before the system ends the connection."""


def tune(connection: socket.socket) -> None:
    """Disable Nagle's algorithm, size the send buffer, and detect a vanished host in about 11 s."""
    with contextlib.suppress(OSError):  # already gone
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BYTES)
        _send_at_once_and_probe(connection)


def find_out(connection: socket.socket) -> None:
    """Disable Nagle's algorithm, and also end a connection whose client reads nothing for UNREAD_MS."""
    with contextlib.suppress(OSError):  # already gone
        _send_at_once_and_probe(connection)
        if sys.platform == "linux":
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, UNREAD_MS)


def _send_at_once_and_probe(connection: socket.socket) -> None:
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    if sys.platform == "linux":
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, 5)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, 2)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT, 3)


def reset_at_close(connection: socket.socket) -> None:
    """Make the next close a reset that discards unsent data."""
    with contextlib.suppress(OSError):  # already gone
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET_AT_CLOSE)
