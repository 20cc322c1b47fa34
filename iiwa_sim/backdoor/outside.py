"""What the backdoor reaches besides controller and clock."""

from collections.abc import Sequence
from typing import Protocol


class Entrance(Protocol):
    """Where clients come in."""

    def refuse(self) -> None:
        """Let nobody connect."""

    def accept(self) -> None:
        """Let clients connect again."""

    def drop_arriving(self, *, reset: bool) -> None:
        """Close, or reset, the connections that are there and not served yet."""


class Entrances:
    """Several in one: one for each dialect."""

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
