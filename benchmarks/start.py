"""Time from the start of the process to its first reply, and of `import iiwa_sim`."""

import subprocess
import sys
from statistics import median
from time import perf_counter

from benchmarks.figures import Figure, Kind
from benchmarks.peers import ECHO, IIWA_SIM, Line, listening

STARTS = 15
_IMPORT = "from time import perf_counter; s = perf_counter(); import iiwa_sim; print(perf_counter() - s)"


def measure() -> list[Figure]:
    """Measure iiwa-sim and the echo server alternately; the first start of each is dropped, as it reads
    from disk."""
    of_sim: list[float] = []
    of_echo: list[float] = []
    for turn in range(STARTS + 1):
        for command, taken in ((IIWA_SIM, of_sim), (ECHO, of_echo)):
            start = perf_counter()
            with listening(command) as address, Line(*address) as line:
                line.ask(b"hello\r\n")
                if turn:
                    taken.append(perf_counter() - start)
    imports = [float(subprocess.check_output([sys.executable, "-c", _IMPORT])) for _ in range(STARTS)]
    return [
        Figure("start to first reply", median(of_sim), "s", median(of_echo)),
        Figure("import iiwa_sim", 1e3 * median(imports), "ms", at_most=20.0, kind=Kind.WALL),
    ]
