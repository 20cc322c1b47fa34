"""Cost of the status port: latency of replies with ten readers at 500 Hz, one of which never reads."""

import multiprocessing
import os
import selectors
import socket
from multiprocessing.connection import Connection
from statistics import median

from benchmarks.figures import Figure, Kind, percentile
from benchmarks.peers import both, one_processor
from benchmarks.replies import ASKS_PER_BLOCK, BLOCKS, QUESTION, check_moving, keep_moving

READERS = 9
RATE_HZ = 500


def measure() -> list[Figure]:
    """Measure; blocks of both servers alternate, as for the replies without a status port.

    Both servers and the client that asks share one processor; the readers may have the others.
    """
    everywhere = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else None
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    of_sim: list[float] = []
    of_echo: list[float] = []
    stream = ("--status-port", str(port), "--status-rate", str(RATE_HZ))
    with (
        one_processor(),
        both(*stream) as (sim, echo),
        socket.create_connection(("127.0.0.1", port)),  # never reads
    ):
        counted, counting = multiprocessing.Pipe(duplex=False)
        readers = multiprocessing.Process(target=_read, args=(port, counting, everywhere), daemon=True)
        readers.start()
        counting.close()
        keep_moving(sim)
        for block in range(BLOCKS + 2):
            for line, samples in ((sim, of_sim), (echo, of_echo)):
                block_of = [line.timed(QUESTION)[0] for _ in range(ASKS_PER_BLOCK)]
                if block >= 2:  # warm-up
                    samples += block_of
            check_moving(sim)
    lines_hz = counted.recv()
    readers.join()
    p50, p99 = (median(of_sim), median(of_echo)), (percentile(of_sim, 0.99), percentile(of_echo, 0.99))
    return [
        Figure(
            "with 10 status readers, ask-answer, p50",
            p50[0],
            "us",
            p50[1],
            ratio_at_most=1.1,
            kind=Kind.RATIO,
        ),
        Figure(
            "with 10 status readers, ask-answer, p99",
            p99[0],
            "us",
            p99[1],
            ratio_at_most=1.5,
            kind=Kind.TAIL,
        ),
        Figure("lines per simulated second, of the reader that misses most", lines_hz, "Hz"),
    ]


def _read(port: int, counting: Connection, processors: set[int] | None) -> None:
    """Read, in a process of its own, until the server has gone; sends `counting` the lowest rate of lines."""
    if processors is not None:
        os.sched_setaffinity(0, processors)
    rests = {socket.create_connection(("127.0.0.1", port)): b"" for _ in range(READERS)}
    ticks: dict[socket.socket, list[int]] = {reader: [] for reader in rests}
    with selectors.DefaultSelector() as selector:
        for reader in rests:
            selector.register(reader, selectors.EVENT_READ)
        while selector.get_map():
            for key, _ in selector.select():
                reader = key.fileobj
                assert isinstance(reader, socket.socket)
                data = reader.recv(1 << 16)
                if not data:
                    selector.unregister(reader)
                    reader.close()
                *lines, rests[reader] = (rests[reader] + data).split(b"\n")
                ticks[reader] += [_tick(line) for line in lines]
    counting.send(min((len(each) - 1) / (each[-1] - each[0]) * 500.0 for each in ticks.values()))


def _tick(line: bytes) -> int:
    return int(line.partition(b'"tick":')[2].partition(b",")[0])
