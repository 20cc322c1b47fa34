"""A port that can refuse who connects, and accept again."""

import asyncio
import socket
from collections.abc import Callable

from iiwa_sim.serve.listening import BACKLOG, ListenFault, address_of, host_and_port, listen, why


class Door:
    """Listens with a protocol for every connection, from `open` to `close`.

    Between `refuse` and `accept` the system answers RST to whoever connects. The port remains ours: a socket
    is bound to it that does not listen.
    """

    def __init__(self, open_protocol: Callable[[], asyncio.BaseProtocol], host: str, port: int) -> None:
        self._open_protocol = open_protocol
        self._asked = (host, port)
        self._server: asyncio.Server | None = None
        self._bound: socket.socket | None = None  # while connections are refused, and until they are served
        self._accepting: asyncio.Task[None] | None = None

    async def open(self) -> None:
        """Raises ListenFault."""
        self._server = await listen(self._open_protocol, *self._asked)

    @property
    def address(self) -> tuple[str, int]:
        """Host and port listened on, or refused at."""
        if self._bound is not None:
            host, port = self._bound.getsockname()[:2]
            return host, port
        return address_of(self._server)

    def refuse(self) -> None:
        """Let nobody connect until `accept`. Raises ListenFault where the port cannot be kept."""
        if self._bound is None:
            if self._server is not None:
                listening = self._server.sockets[0]
                family, address = listening.family, listening.getsockname()
                self._server.close()
                self._bound = _bound(family, address)
        elif self._accepting is not None:  # asked for, and not begun
            self._accepting.cancel()
            self._accepting = None
            family, address = self._bound.family, self._bound.getsockname()
            self._bound.close()
            self._bound = _bound(family, address)

    def accept(self) -> None:
        """Let clients connect from now on."""
        if self._bound is not None and self._accepting is None:
            self._bound.listen(BACKLOG)
            self._accepting = asyncio.get_running_loop().create_task(self._serve(self._bound))

    def close(self) -> None:
        """Listen no more."""
        if self._accepting is not None:
            self._accepting.cancel()
            self._accepting = None
        if self._bound is not None:
            self._bound.close()
            self._bound = None
        if self._server is not None:
            self._server.close()
            self._server = None

    async def _serve(self, listening: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        # Up to where it serves nothing is waited for, so the state is always one of the two.
        self._server = await loop.create_server(self._open_protocol, sock=listening, start_serving=False)
        self._bound = self._accepting = None
        await self._server.start_serving()


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
