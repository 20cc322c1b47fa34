"""An address to listen on, and what to say when that does not work."""

import asyncio
import os
import socket
from collections.abc import Callable

from iiwa_sim.wording import Unusable, harmless, shortened

MAX_PORT = 65535

BACKLOG = 512
"""Clients that may knock at once."""

LONGEST_HOST = 100
"""Characters of a host that a message shows."""


class ListenFault(Unusable):
    """An address that cannot be listened on. The message is one line."""


async def listen(open_protocol: Callable[[], asyncio.BaseProtocol], host: str, port: int) -> asyncio.Server:
    """A server that listens on `host`:`port` with a protocol for every connection. Raises ListenFault."""
    listener = await open_listener(host, port)
    return await asyncio.get_running_loop().create_server(open_protocol, sock=listener, backlog=BACKLOG)


async def open_listener(host: str, port: int) -> socket.socket:
    """A socket that listens on `host`:`port`. Raises ListenFault.

    `port` 0 picks a free one. A host name stands for its first address, IPv4 before IPv6.
    """
    if not 0 <= port <= MAX_PORT:
        raise ListenFault(f"cannot listen on port {port}: expected 0 to {MAX_PORT}")
    if not host:
        raise ListenFault("cannot listen on host '': expected an address or a host name, 0.0.0.0 for all")
    try:
        family, address = await _resolve(host)
        return socket.create_server((address, port), family=family, backlog=BACKLOG)
    except (OSError, ValueError) as fault:  # ValueError for characters no host name has
        shown = host_and_port(shortened(harmless(host), LONGEST_HOST), port)
        raise ListenFault(f"cannot listen on {shown}: {why(fault)}") from fault


def address_of(server: asyncio.Server | None) -> tuple[str, int]:
    """Host and port listened on. Raises RuntimeError where there is no server."""
    if server is None:
        raise RuntimeError("the server does not listen")
    host, port = server.sockets[0].getsockname()[:2]
    return host, port


def peer_of(transport: asyncio.BaseTransport) -> str:
    """Who is connected."""
    peer = transport.get_extra_info("peername")
    return host_and_port(*peer[:2]) if peer else "a client already gone"


def host_and_port(host: str, port: int) -> str:
    """An address as one writes it; an IPv6 host goes into brackets."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def why(fault: Exception) -> str:
    """What the system says of a fault, without the address."""
    if isinstance(fault, OSError) and fault.errno is not None:
        # Python adds the address to what bind(2) says; name resolution has numbers of its own, below 0
        return os.strerror(fault.errno) if fault.errno > 0 else str(fault.strerror)
    return str(fault)


async def _resolve(host: str) -> tuple[socket.AddressFamily, str]:
    # One address only: with two, port 0 would stand for two ports.
    found = await asyncio.get_running_loop().getaddrinfo(
        host, None, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
    )
    family, _, _, _, address = min(found, key=lambda info: info[0] != socket.AF_INET)
    return family, str(address[0])
