"""What robots at rest cost: computing and memory of a process that serves many of them, and its replies."""

import contextlib
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from time import monotonic, sleep

from benchmarks.figures import Figure, Kind
from benchmarks.peers import ECHO, IIWA_SIM, Line, listening

ROBOTS, ROBOTS_OF_GATE = 500, 50
SECONDS, SECONDS_OF_GATE = 60.0, 3.0
ONE_ALONE_S = 10.0
QUESTION = b"get joint position\r\n"
BLOCKS = 20
ASKS_PER_BLOCK = 100
TICKS_PER_SECOND = os.sysconf("SC_CLK_TCK")


class Fleet:
    """A process with robots that listen on ports of its choice."""

    def __init__(self, process: subprocess.Popen[str], count: int) -> None:
        self._pid = process.pid
        assert process.stdout is not None
        self.ports = [int(process.stdout.readline().rpartition(":")[2]) for _ in range(count)]

    def cpu_s(self) -> float:
        """Seconds of computing, since its start."""
        fields = Path(f"/proc/{self._pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / TICKS_PER_SECOND

    def memory_mb(self) -> float:
        """Resident memory of the process (MB)."""
        lines = Path(f"/proc/{self._pid}/status").read_text().splitlines()
        (resident,) = (line.split()[1] for line in lines if line.startswith("VmRSS"))
        return int(resident) / 1024

    def idle_share(self, seconds: float) -> float:
        """Percent of a core that it computes while nobody asks anything."""
        sleep(1.0)
        began_s, spent_s = monotonic(), self.cpu_s()
        sleep(seconds)
        return 100.0 * (self.cpu_s() - spent_s) / (monotonic() - began_s)


def measure() -> list[Figure]:
    """One robot, and many of them."""
    with _fleet(1) as fleet:
        one_mb, one_cpu_s = fleet.memory_mb(), fleet.cpu_s()
        found = [_at_rest(1, fleet.idle_share(ONE_ALONE_S))]
    with _fleet(ROBOTS) as fleet:
        more = ROBOTS - 1
        memory_mb, cpu_s = (fleet.memory_mb() - one_mb) / more, (fleet.cpu_s() - one_cpu_s) / more
        found += [
            Figure("each further robot: memory", memory_mb, "MB", at_most=0.4, kind=Kind.CPU),
            Figure("each further robot: computing until it listens", 1e3 * cpu_s, "ms"),
            _at_rest(ROBOTS, fleet.idle_share(SECONDS)),
            *_replies(fleet),
        ]
    return found


def gate() -> list[Figure]:
    """Fewer robots, for a shorter time: a robot that ticks at rest shows all the same."""
    with _fleet(ROBOTS_OF_GATE) as fleet:
        return [_at_rest(ROBOTS_OF_GATE, fleet.idle_share(SECONDS_OF_GATE))]


def _at_rest(count: int, share: float) -> Figure:
    """Half a core for 500 robots; a single one may cost more than its part of that."""
    most = 0.2 if count == 1 else 50.0 * count / ROBOTS
    robots = "one robot" if count == 1 else f"{count} robots in one process"
    return Figure(f"{robots} at rest", share, "% of a core", at_most=most, kind=Kind.CPU)


def _replies(fleet: Fleet) -> list[Figure]:
    """Time to a reply of the first and the last robot, beside that of an echo server."""
    taken: dict[str, list[float]] = {"first": [], "last": [], "echo": []}
    with contextlib.ExitStack() as stack:
        address = stack.enter_context(listening(ECHO))
        places = {"first": ("127.0.0.1", fleet.ports[0]), "last": ("127.0.0.1", fleet.ports[-1])}
        lines = {
            name: stack.enter_context(Line(*place)) for name, place in {**places, "echo": address}.items()
        }
        for block in range(BLOCKS + 1):
            for name, line in lines.items():
                block_of = [line.timed(QUESTION)[0] for _ in range(ASKS_PER_BLOCK)]
                if block:
                    taken[name] += block_of
    return [
        Figure(
            f"the {name} of {ROBOTS} robots at rest, p50",
            median(taken[name]),
            "us",
            median(taken["echo"]),
            ratio_at_most=3,
            kind=Kind.RATIO,
        )
        for name in ("first", "last")
    ]


@contextlib.contextmanager
def _fleet(count: int) -> Iterator[Fleet]:
    options = [] if count == 1 else ["--count", str(count)]
    with subprocess.Popen([*IIWA_SIM, *options], stdout=subprocess.PIPE, text=True) as process:
        try:
            yield Fleet(process, count)
        finally:
            process.terminate()
