"""Time from the start of the process to its first reply, and of imports.

As in an installation, modules are compiled beforehand: into a folder of their own.
"""

import os
import subprocess
import sys
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter
from unittest.mock import patch

from benchmarks.figure import Figure
from benchmarks.servers import IIWA_SIM, Line, listening

STARTS = 15
_IMPORT = "from time import perf_counter; s = perf_counter(); import iiwa_sim; print(perf_counter() - s)"


def measure() -> list[Figure]:
    """Measure; the first start is dropped, as it compiles and reads from disk."""
    taken: list[float] = []
    with TemporaryDirectory() as folder, patch.dict(os.environ, PYTHONPYCACHEPREFIX=folder):
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
        for _ in range(STARTS + 1):
            start = perf_counter()
            with listening([*IIWA_SIM, "--port", "0"]) as address, Line(*address) as line:
                line.asks("hello", "hello")
                taken.append(perf_counter() - start)
        imports = [float(subprocess.check_output([sys.executable, "-c", _IMPORT])) for _ in range(STARTS)]
    return [
        Figure("start to first reply", median(taken[1:]), "s", at_most=0.45),
        Figure("import iiwa_sim", 1e3 * median(imports), "ms", at_most=20.0),
    ]
