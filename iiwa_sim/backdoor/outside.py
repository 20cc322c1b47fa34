"""The interface of the backdoor to the servers."""

from typing import Protocol


class Entrance(Protocol):
    """A port where clients connect."""

    def refuse(self) -> None:
        """Refuse new connections."""

    def accept(self) -> None:
        """Accept connections again."""

    def drop_arriving(self, *, reset: bool) -> None:
        """Close or reset the connections that wait to be accepted."""
