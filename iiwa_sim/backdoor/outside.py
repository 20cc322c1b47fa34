"""What the backdoor reaches besides controller and clock."""

from typing import Protocol


class Entrance(Protocol):
    """Where clients come in."""

    def refuse(self) -> None:
        """Let nobody connect."""

    def accept(self) -> None:
        """Let clients connect again."""
