"""The log that a protocol writes to; `serve` and `cli` decide what becomes of the entries."""

from typing import Protocol


class ProtocolLog(Protocol):
    """Lines are passed as printable ASCII, with other characters escaped."""

    def wants_commands(self) -> bool:
        """Whether `command` is wanted; asked once for each batch of lines."""

    def command(self, session: str, line: str, reply: str) -> None:
        """A line was carried out and answered."""

    def refused(self, session: str, line: str, code: int, reason: str) -> None:
        """A line was answered `error` or `unknown command`; codes are results of robot_movement_interface."""

    def ignored(self, session: str, command: str, takes: str, beyond: int) -> None:
        """A session sent `beyond` more values than a command takes, for the first time: they are ignored."""

    def odd(self, session: str, command: str, remark: str) -> None:
        """A command was carried out, but may not be what the client means; told once for each session."""

    def stopped(self, session: str, vanished: bool) -> None:
        """The moving robot stops because its client has vanished, or has said bye."""

    def exception(self, session: str, line: str, fault: Exception) -> None:
        """The controller failed at this line with an internal error; the line was answered `error`."""
