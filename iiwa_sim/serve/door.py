"""A port that can refuse who connects, and accept again."""

import asyncio
import socket
from collections.abc import Callable

from iiwa_sim.serve.listening import BACKLOG, Acceptor, ListenFault, host_and_port, listen, why


class Door:
    """Listens with a protocol for every connection, from `open` to `close`.

    Between `refuse` and `accept` the system answers RST to whoever connects. The port remains ours: a socket
    is bound to it that does not listen.
    """

    def __init__(self, open_protocol: Callable[[], asyncio.BaseProtocol], host: str, port: int) -> None:
        self._open_protocol = open_protocol
        self._asked = (host, port)
        self._acceptor: Acceptor | None = None
        self._bound: socket.socket | None = None  # while connections are refused

    async def open(self) -> None:
        """Raises ListenFault."""
        self._acceptor = await listen(self._open_protocol, *self._asked)

    @property
    def address(self) -> tuple[str, int]:
        """Host and port listened on, or refused at. Raises RuntimeError before `open` and after `close`."""
        if self._bound is not None:
            host, port = self._bound.getsockname()[:2]
            return host, port
        if self._acceptor is None:
            raise RuntimeError("the server does not listen")
        return self._acceptor.address

    def refuse(self) -> None:
        """Let nobody connect until `accept`. Raises ListenFault where the port cannot be kept."""
        if self._acceptor is not None:
            family, address = self._acceptor.bound_to
            self._acceptor.close()
            self._acceptor = None
            self._bound = _bound(family, address)

    def accept(self) -> None:
        """Let clients connect from now on."""
        if self._bound is not None:
            self._bound.listen(BACKLOG)
            self._acceptor = Acceptor(self._bound, self._open_protocol)
            self._bound = None

    def drop_arriving(self, *, reset: bool) -> None:
        """Close, or reset, the connections that are there and not served yet."""
        if self._acceptor is not None:
            self._acceptor.drop_arriving(reset=reset)

    def close(self) -> None:
        """Listen no more."""
        if self._bound is not None:
            self._bound.close()
            self._bound = None
        if self._acceptor is not None:
            self._acceptor.close()
            self._acceptor = None


def _bound(family: int, address: tuple[str, int]) -> socket.socket:
    """A socket that keeps an address, as `socket.create_server` would bind it."""
    bound = socket.socket(family)
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6:
            bound.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
        bound.bind(address)
    except OSError as fault:
        bound.close()
        raise ListenFault(f"cannot keep {host_and_port(*address[:2])}: {why(fault)}") from fault
    return bound
