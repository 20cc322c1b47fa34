"""How many samples a property is tested with: a part of them in `make test`, all in `make test-slow`."""

from __future__ import annotations

import os

ALL = os.environ.get("SAMPLES") == "all"


def some(count: int) -> int:
    """All samples with SAMPLES=all, else a fifth, but not fewer than 5."""
    return count if ALL else max(count // 5, 5)
