"""The exceptions of clients, besides OSError for the connection itself."""


class CommandError(Exception):
    """The robot rejected the command, which the message quotes."""


class UnknownCommandError(CommandError):
    """The robot answered `unknown command`: the server is older than this client, or of another kind."""


class Krc4Error(CommandError):
    """The robot rejected a KRC4 message."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code
        """Number of the error, see docs/krc4.md; from 3000 on those of robot_movement_interface."""


class ReplyError(Exception):
    """The reply does not fit the command: client and server are out of step, or the protocol is another."""
