"""How many samples a property is tested with: a part of them in `make test`, all in `make test-slow`."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

import pytest

ALL = os.environ.get("SAMPLES") == "all"
PART = 7  # a prime: of a grid of cases it meets each row and each column


def some(count: int) -> int:
    """All samples with SAMPLES=all, else a seventh, but not fewer than 5."""
    return count if ALL else max(count // PART, 5)


def spread(cases: Iterable[tuple[Any, ...]], each: int = PART) -> list[Any]:
    """Parameters of a test, of which `make test` tries each seventh: `make test-slow` tries the others."""
    return [
        pytest.param(*case, marks=() if number % each == 0 else pytest.mark.slow)
        for number, case in enumerate(cases)
    ]
