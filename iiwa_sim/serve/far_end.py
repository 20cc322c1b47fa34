"""How much of what was sent the other end of a connection has read, where its system is ours.

TCP tells a sender what has arrived, not what has been read: in between lies the receive buffer of the other
end, which by default holds some 200 lines of ours. Linux counts both for every socket, and tells of all
sockets of a network namespace (sock_diag(7)): so also of the far end of a connection on the same machine. Of
one that is elsewhere, behind a proxy or an address translation nothing is known.
"""

import contextlib
import socket
import struct
import sys
from typing import NamedTuple

# From linux/netlink.h, linux/sock_diag.h, linux/inet_diag.h and linux/tcp.h.
_NETLINK_SOCK_DIAG = 4
_SOCK_DIAG_BY_FAMILY = 20
_NLM_F_REQUEST = 1
_INET_DIAG_INFO = 2
_ANY_STATE = _NO_COOKIE = 0xFFFFFFFF
_HEAD = struct.Struct("=IHHII")  # nlmsghdr: length, type, flags, sequence, port
_ASKED = struct.Struct("=BBBxI")  # inet_diag_req_v2, up to the socket: family, protocol, extensions, states
_PORTS = struct.Struct("!HH")  # the socket: first its own address and port, then those of its other end
_BEHIND = struct.Struct("=III")  # interface and cookie
_SOCKET_AT = _HEAD.size + 4
_UNREAD = struct.Struct("=I")
_UNREAD_AT = _HEAD.size + 56  # in inet_diag_msg: idiag_rqueue
_ATTRIBUTES_AT = _HEAD.size + 72
_ATTRIBUTE = struct.Struct("=HH")
_RECEIVED = struct.Struct("=Q")
_RECEIVED_AT = 128  # in tcp_info: tcpi_bytes_received
_ANSWER_BYTES = 8192


class FarEnd(NamedTuple):
    """The other end of a connection, as a system would name it."""

    family: int
    named: bytes
    """Ports and addresses: first its own, then ours."""


def far_end(connection: socket.socket) -> FarEnd | None:
    """The far end of a connection over TCP; None where it has gone already."""
    try:
        theirs, ours = connection.getpeername(), connection.getsockname()
        family = connection.family
        hosts = [socket.inet_pton(family, host.partition("%")[0]) for host in (theirs[0], ours[0])]
    except OSError:
        return None
    places = b"".join(host.ljust(16, b"\0") for host in hosts)
    interface = theirs[3] if family == socket.AF_INET6 else 0  # of an address that holds for a link only
    behind = _BEHIND.pack(interface, _NO_COOKIE, _NO_COOKIE)
    return FarEnd(family, _PORTS.pack(theirs[1], ours[1]) + places + behind)


class FarEnds:
    """Asks the system about far ends, in some microseconds each, from `open` to `close`."""

    def __init__(self) -> None:
        self._asking: socket.socket | None = None
        self._asked = 0

    def open(self) -> None:
        """Open the socket by which Linux is asked; elsewhere, and where it fails, nothing will be known."""
        if sys.platform == "linux":
            with contextlib.suppress(OSError):  # a system that does not let us, or has no descriptor left
                self._asking = socket.socket(socket.AF_NETLINK, socket.SOCK_DGRAM, _NETLINK_SOCK_DIAG)
                self._asking.connect((0, 0))
                self._asking.setblocking(False)

    def has_read(self, end: FarEnd) -> int | None:
        """How many bytes of the connection have been read there; None where that is not known."""
        if self._asking is None:
            return None
        self._asked = (self._asked + 1) % 2**32
        what = _ASKED.pack(end.family, socket.IPPROTO_TCP, 1 << (_INET_DIAG_INFO - 1), _ANY_STATE) + end.named
        head = _HEAD.pack(_HEAD.size + len(what), _SOCK_DIAG_BY_FAMILY, _NLM_F_REQUEST, self._asked, 0)
        try:
            self._asking.send(head + what)
            while True:
                answer = self._asking.recv(_ANSWER_BYTES)
                _, kind, _, number, _ = _HEAD.unpack_from(answer)
                if number == self._asked:
                    return _has_read(answer, end) if kind == _SOCK_DIAG_BY_FAMILY else None
        except (OSError, struct.error):  # among them: there is no answer
            return None

    def close(self) -> None:
        """Nothing more is known."""
        if self._asking is not None:
            self._asking.close()
            self._asking = None


def _has_read(answer: bytes, end: FarEnd) -> int | None:
    if answer[_SOCKET_AT : _SOCKET_AT + _PORTS.size] != end.named[: _PORTS.size]:
        return None  # one that listens there, since the connection has gone
    (unread,) = _UNREAD.unpack_from(answer, _UNREAD_AT)
    at = _ATTRIBUTES_AT
    while at < len(answer):
        length, kind = _ATTRIBUTE.unpack_from(answer, at)
        if kind == _INET_DIAG_INFO and length >= _ATTRIBUTE.size + _RECEIVED_AT + _RECEIVED.size:
            received: int = _RECEIVED.unpack_from(answer, at + _ATTRIBUTE.size + _RECEIVED_AT)[0]
            return received - int(unread)
        at += max(_ATTRIBUTE.size, (length + 3) // 4 * 4)
    return None
