"""The interface of the backdoor to the servers."""

from collections.abc import Sequence
from typing import Protocol


class Entrance(Protocol):
    """A port where clients connect."""

    def refuse(self) -> None:
        """Refuse new connections."""

    def accept(self) -> None:
        """Accept connections again."""

    def drop_arriving(self, *, reset: bool) -> None:
        """Close or reset the connections that wait to be accepted."""


class Entrances:
    """All ports together: one for each dialect."""

    def __init__(self, entrances: Sequence[Entrance]) -> None:
        self._entrances = entrances

    def refuse(self) -> None:
        for entrance in self._entrances:
            entrance.refuse()

    def accept(self) -> None:
        for entrance in self._entrances:
            entrance.accept()

    def drop_arriving(self, *, reset: bool) -> None:
        for entrance in self._entrances:
            entrance.drop_arriving(reset=reset)
