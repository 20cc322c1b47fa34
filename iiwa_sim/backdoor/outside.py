"""What the backdoor reaches besides the controller."""

from typing import Protocol


class ClockControl(Protocol):
    """The clock. Times are simulated seconds, 0 to a day; others raise ValueError."""

    @property
    def name(self) -> str:
        """How time passes: real, 10x, fast, stepped."""

    @property
    def paused(self) -> bool: ...

    async def advance(self, seconds: float) -> None:
        """Make the ticks of so much time; returns when they are made."""

    async def run_until_stopped(self, limit_s: float) -> float:
        """Make ticks until the robot has stopped; gives the time that took. Raises TimeoutError."""

    def pause(self) -> None:
        """Make ticks only when told."""

    def resume(self) -> None:
        """Make ticks again."""

    def set(self, name: str) -> None:
        """Let time pass otherwise; raises ValueError where there is no such clock."""


class Entrance(Protocol):
    """Where clients come in."""

    def refuse(self) -> None:
        """Let nobody connect."""

    def accept(self) -> None:
        """Let clients connect again."""
