"""Which faults of ours in ticks to tell: one that recurs 500 times a second must leave the log readable."""

import traceback
from dataclasses import dataclass

QUIET_NS = 1_000_000_000


class TickFaults:
    """Remembers when a fault was told, by its type and place."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, str, int | None], _Recurring] = {}

    def untold(self, fault: Exception, now_ns: int) -> int | None:
        """How often a fault of this kind was not told since the last one, or None if this is not to be."""
        where = traceback.extract_tb(fault.__traceback__)[-1]
        kind = (type(fault).__name__, where.filename, where.lineno)
        recurring = self._known.setdefault(kind, _Recurring())
        if now_ns < recurring.quiet_until_ns:
            recurring.untold += 1
            return None
        untold = recurring.untold
        self._known[kind] = _Recurring(now_ns + QUIET_NS)
        return untold


@dataclass
class _Recurring:
    """A kind of fault: until when it is not told again, and how often it was not."""

    quiet_until_ns: int = 0
    untold: int = 0
