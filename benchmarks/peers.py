"""The two servers that are compared, each in a process of its own, and connections to them."""

import contextlib
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from time import perf_counter_ns
from typing import Self

IIWA_SIM = [sys.executable, "-m", "iiwa_sim", "--port", "0"]
ECHO = [sys.executable, "-m", "benchmarks.echo"]


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
        reply = self.socket.recv(4096)
        while not reply.endswith(b"\n"):
            more = self.socket.recv(4096)
            if not more:
                raise ConnectionError("the server closed the connection")
            reply += more
        return reply

    def timed(self, line: bytes) -> tuple[float, bytes]:
        """The latency (us) and the answer that `ask` gives."""
        start = perf_counter_ns()
        reply = self.ask(line)
        return (perf_counter_ns() - start) / 1e3, reply


@contextlib.contextmanager
def listening(command: list[str]) -> Iterator[tuple[str, int]]:
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
def one_processor() -> Iterator[None]:
    """Keep this process, and those it starts meanwhile, on one processor, where the system (Linux) can.

    A reply within a processor takes 30 to 50 us, one from another that sleeps 100 us and more in a virtual
    machine. A scheduler that moves one of two servers decides the ratio of their medians: 0.85 or 2.4 for the
    same code. On one processor the ratio is that of the work.
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


@contextlib.contextmanager
def both(*options: str) -> Iterator[tuple[Line, Line]]:
    """A connection to iiwa-sim with these options, and one to the echo server.

    Both run all the time, so that other load affects both.
    """
    sim_command = [*IIWA_SIM, *options]
    with listening(sim_command) as sim, listening(ECHO) as echo, Line(*sim) as to_sim, Line(*echo) as to_echo:
        yield to_sim, to_echo
