"""What a dialect tells its log; serve and cli decide what becomes of it."""

from typing import Protocol


class DialectLog(Protocol):
    """Lines come as harmless text: what is not printable ASCII is escaped."""

    @property
    def commands(self) -> bool:
        """Whether `command` is wanted; asked once for a slice of lines, so it is free where it is not."""

    def command(self, session: str, line: str, reply: str) -> None:
        """A line that was carried out and what was answered to it."""

    def refused(self, session: str, line: str, code: int, reason: str) -> None:
        """The reason of an `error` or `unknown command`; codes are robot_movement_interface's results."""

    def ignored(self, session: str, command: str, takes: str, beyond: int) -> None:
        """A session sends so many values more than a command takes, for the first time: they are ignored."""

    def stopped(self, session: str, vanished: bool) -> None:
        """The robot moved and stops, since its client has vanished, or has said bye."""

    def exception(self, session: str, line: str, fault: Exception) -> None:
        """The controller failed at this line, with its traceback on `fault`; it was answered `error`."""
