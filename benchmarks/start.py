"""Time from the start of the process to its first reply, with modules compiled as in an installation."""

import os
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter
from unittest.mock import patch

from benchmarks.figure import Figure
from benchmarks.servers import IIWA_SIM, Line, listening

STARTS = 15
CELL = Path(__file__).parent.parent / "examples" / "boxes.toml"


def measure() -> list[Figure]:
    """Measure a robot alone, and one with parts."""
    with TemporaryDirectory() as folder, patch.dict(os.environ, PYTHONPYCACHEPREFIX=folder):
        os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
        alone_s, with_parts_s = _start_s(), _start_s(str(CELL))
    return [
        Figure("start to first reply", alone_s, "s", at_most=0.45),
        Figure("start to first reply, with parts", with_parts_s, "s", at_most=0.8),
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
