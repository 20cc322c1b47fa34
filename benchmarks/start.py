"""Time from the start of the process to its first reply, and of imports.

As in an installation, modules are compiled beforehand: into a folder of their own, whatever the environment
says.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from statistics import median
from tempfile import TemporaryDirectory
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
    with _compiled_beforehand():
        for turn in range(STARTS + 1):
            for command, taken in ((IIWA_SIM, of_sim), (ECHO, of_echo)):
                start = perf_counter()
                with listening(command) as address, Line(*address) as line:
                    line.ask(b"hello\r\n")
                    if turn:
                        taken.append(perf_counter() - start)
        imports = [float(subprocess.check_output([sys.executable, "-c", _IMPORT])) for _ in range(STARTS)]
    return [
        Figure("start to first reply", median(of_sim), "s", median(of_echo), at_most=0.45, kind=Kind.WALL),
        Figure("import iiwa_sim", 1e3 * median(imports), "ms", at_most=20.0, kind=Kind.WALL),
    ]


@contextmanager
def _compiled_beforehand() -> Iterator[None]:
    """Processes started here keep compiled modules, in a folder that goes at the end."""
    before = dict(os.environ)
    with TemporaryDirectory(prefix="iiwa-sim-bench-") as folder:
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
        os.environ["PYTHONPYCACHEPREFIX"] = folder
        try:
            yield
        finally:
            os.environ.clear()
            os.environ.update(before)
