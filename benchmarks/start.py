"""Time from the start of the process to its first reply, and of imports.

Modules are compiled beforehand, as in an installation, into a folder of their own.
"""

import os
import subprocess
import sys
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter
from unittest.mock import patch

from benchmarks.figure import Figure
from benchmarks.servers import IIWA_SIM, Line, listening

STARTS = 15
CELL = Path(__file__).parent.parent / "examples" / "boxes.toml"
_IMPORT = "from time import perf_counter; s = perf_counter(); import iiwa_sim; print(perf_counter() - s)"


def measure() -> list[Figure]:
    """Measure a robot alone, one with parts, and imports."""
    with TemporaryDirectory() as folder, patch.dict(os.environ, PYTHONPYCACHEPREFIX=folder):
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
        alone_s, with_parts_s = _start_s(), _start_s(str(CELL))
        imports = [float(subprocess.check_output([sys.executable, "-c", _IMPORT])) for _ in range(STARTS)]
    return [
        Figure("start to first reply", alone_s, "s", at_most=0.45),
        Figure("start to first reply, with parts", with_parts_s, "s", at_most=0.8),
        Figure("import iiwa_sim", 1e3 * median(imports), "ms", at_most=20.0),
    ]


def _start_s(*options: str) -> float:
    """Time to the first reply; the first start is dropped, as it compiles and reads from disk."""
    taken = []
    for _ in range(STARTS + 1):
        start = perf_counter()
        with listening([*IIWA_SIM, "--port", "0", *options]) as address, Line(*address) as line:
            line.asks("hello", "hello")
            taken.append(perf_counter() - start)
    return median(taken[1:])
