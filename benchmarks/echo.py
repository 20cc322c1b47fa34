"""A bare echo server in asyncio: the lower bound for the latency of a line server in Python.

It does not parse lines. It is an `asyncio.Protocol`, as most such servers are, for which the loop allocates a
buffer for every read; iiwa-sim reads into a buffer of its own and so can be faster. `python -m
benchmarks.echo` prints `listening on HOST:PORT` and echoes until it is ended.
"""

import asyncio
from typing import cast


class Echo(asyncio.Protocol):
    """One connection."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)

    def data_received(self, data: bytes) -> None:
        self._transport.write(data)


async def main() -> None:
    """Serve on a free port of this machine."""
    server = await asyncio.get_running_loop().create_server(Echo, "127.0.0.1", 0)
    host, port = server.sockets[0].getsockname()
    print(f"listening on {host}:{port}", flush=True)
    await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(main())
