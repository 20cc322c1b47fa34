"""What a connection of a client asks of the system."""

import contextlib
import socket
import struct
import sys

SEND_BYTES = 131_072
"""What the system may hold for a client that reads slowly; beyond it, replies wait in the process, up to
asyncio's 64 KiB, and then its commands wait."""

_RESET_AT_CLOSE = struct.pack("ii", 1, 0)  # struct linger: no time for what is not sent yet


UNREAD_MS = 30_000
"""For how long a host may leave unacknowledged, or its client unread, what does not wait in the process."""


def tune(connection: socket.socket) -> None:
    """Send at once, hold SEND_BYTES, and find out in some 11 s about a host that vanishes without a word."""
    with contextlib.suppress(OSError):  # already gone
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BYTES)
        _send_at_once_and_probe(connection)


def find_out(connection: socket.socket) -> None:
    """Send at once, and find out also about a client that leaves unread what it gets for UNREAD_MS."""
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
    """Let its close be a reset: what is not sent yet is lost."""
    with contextlib.suppress(OSError):  # already gone
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET_AT_CLOSE)
