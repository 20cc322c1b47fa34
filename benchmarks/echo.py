"""The floor: the least a line server in Python's asyncio can do, namely send back what it got.

It does not look for lines. It is an `asyncio.Protocol`, as most such servers are, for which the loop makes a
new buffer at every read; iiwa-sim reads into one buffer of its own, and so can answer sooner than this floor.
`python -m benchmarks.echo` says `listening on HOST:PORT` and echoes until it is ended.
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
