"""The servers that are measured, each in a process of its own, and connections to them.

`python -m benchmarks.servers` is a bare echo server in asyncio: the lower bound for the latency of a line
server in Python. It does not parse lines.
"""

import asyncio
import contextlib
import os
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from time import perf_counter_ns
from typing import Self, cast

IIWA_SIM = (sys.executable, "-m", "iiwa_sim")
ECHO = (sys.executable, "-m", "benchmarks.servers")


class Line:
    """A minimal client in lines."""

    def __init__(self, host: str, port: int) -> None:
        self.socket = socket.create_connection((host, port), timeout=30)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def ask(self, line: bytes) -> bytes:
        """Send one line with its end and return the reply with its end."""
        self.socket.sendall(line)
        reply = b""
        while not reply.endswith(b"\n"):
            more = self.socket.recv(4096)
            if not more:
                raise ConnectionError("the server closed the connection")
            reply += more
        return reply

    def asks(self, line: str, expected: str = "done") -> None:
        """Send a command that has to be answered as expected."""
        if (reply := self.ask(line.encode() + b"\r\n")) != expected.encode() + b"\r\n":
            raise RuntimeError(f"{line}: {reply!r}")

    def latency_us(self, line: bytes) -> float:
        """Return the time until the reply to a line."""
        start = perf_counter_ns()
        self.ask(line)
        return (perf_counter_ns() - start) / 1e3


@contextlib.contextmanager
def listening(command: Sequence[str]) -> Iterator[tuple[str, int]]:
    """Start a server by `command` and read its address from the line `listening on`."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            said = process.stdout.readline().split()
            if said[:2] != ["listening", "on"]:
                raise RuntimeError(f"{command} did not start")
            host, _, port = said[2].rpartition(":")
            yield host, int(port)
        finally:
            process.terminate()


@contextlib.contextmanager
def both(*options: str) -> Iterator[tuple[Line, Line]]:
    """Yield connections to iiwa-sim with these options and to the echo server, which share all other load."""
    sim_command = (*IIWA_SIM, "--port", "0", *options)
    with listening(sim_command) as sim, listening(ECHO) as echo, Line(*sim) as to_sim, Line(*echo) as to_echo:
        yield to_sim, to_echo


@contextlib.contextmanager
def one_processor() -> Iterator[None]:
    """Keep this process, and those it starts meanwhile, on one processor, where the system (Linux) can.

    A reply within a processor takes 30 to 50 us, one from another that sleeps 100 us and more in a virtual
    machine. On one processor the ratio of two servers is that of their work, not that of the scheduler.
    """
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


class Echo(asyncio.Protocol):
    """One connection of the echo server."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)

    def data_received(self, data: bytes) -> None:
        self._transport.write(data)


async def echo() -> None:
    """Serve on a free port of this machine, and print it."""
    server = await asyncio.get_running_loop().create_server(Echo, "127.0.0.1", 0)
    host, port = server.sockets[0].getsockname()
    print(f"listening on {host}:{port}", flush=True)
    await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(echo())
