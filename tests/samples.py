"""Number of samples of a property: few in `make test`, many with HYPOTHESIS_PROFILE=many."""

from __future__ import annotations

import os

MANY = os.environ.get("HYPOTHESIS_PROFILE") in ("many", "hunt")


def some(count: int) -> int:
    """Return a tenth of the samples, at least 4; with the profile `many` all of them."""
    return count if MANY else max(count // 10, 4)
