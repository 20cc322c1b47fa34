"""A log of sessions that keeps its entries."""

from __future__ import annotations


class Journal:
    """A `SessionLog` whose entries tests read."""

    def __init__(self, *, fails: bool = False) -> None:
        """With `fails` an internal error is raised again, for tests that expect none."""
        self.refusals: list[tuple[str, str, int, str]] = []
        self.remarks: list[tuple[str, str, str]] = []
        self.stops: list[tuple[str, bool]] = []
        self.faults: list[tuple[str, str, Exception]] = []
        self._fails = fails

    def refused(self, session: str, line: str, code: int, reason: str) -> None:
        self.refusals.append((session, line, code, reason))

    def odd(self, session: str, command: str, remark: str) -> None:
        self.remarks.append((session, command, remark))

    def stopped(self, session: str, vanished: bool) -> None:
        self.stops.append((session, vanished))

    def exception(self, session: str, line: str, fault: Exception) -> None:
        if self._fails:
            raise AssertionError(f"{session}: {line}") from fault
        self.faults.append((session, line, fault))
