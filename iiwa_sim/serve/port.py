"""A listening port that can refuse connections and accept them again."""

import asyncio
import socket
from collections.abc import Callable

from iiwa_sim.serve.listening import BACKLOG, Acceptor, ListenFault, host_and_port, listen, why


class Port:
    """Listens with a protocol for every connection, from `open` to `close`.

    Between `refuse` and `accept` the system answers connection attempts with RST. The port stays reserved: a
    socket is bound to it that does not listen.
    """

    def __init__(self, open_protocol: Callable[[], asyncio.BaseProtocol], host: str, port: int) -> None:
        self._open_protocol = open_protocol
        self._asked = (host, port)
        self._acceptor: Acceptor | None = None
        self._bound: socket.socket | None = None  # while connections are refused

    async def open(self) -> None:
        """Start listening. Raises ListenFault."""
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
        """Refuse new connections until `accept`. Raises ListenFault if the port cannot be kept."""
        if self._acceptor is not None:
            family, address = self._acceptor.bound_to
            self._acceptor.close()
            self._acceptor = None
            self._bound = _bound(family, address)

    def accept(self) -> None:
        """Accept connections from now on."""
        if self._bound is not None:
            self._bound.listen(BACKLOG)
            self._acceptor = Acceptor(self._bound, self._open_protocol)
            self._bound = None

    def drop_arriving(self, *, reset: bool) -> None:
        """Close or reset the connections that wait to be accepted."""
        if self._acceptor is not None:
            self._acceptor.drop_arriving(reset=reset)

    def close(self) -> None:
        """Stop listening."""
        if self._bound is not None:
            self._bound.close()
            self._bound = None
        if self._acceptor is not None:
            self._acceptor.close()
            self._acceptor = None


def _bound(family: int, address: tuple[str, int]) -> socket.socket:
    """A socket that reserves an address, bound as `socket.create_server` would bind it."""
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
