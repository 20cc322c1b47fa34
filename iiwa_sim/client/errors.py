"""The exceptions of clients, besides OSError for the connection itself."""


class CommandError(Exception):
    """The robot rejected the command; the message quotes it, with code and reason."""

    def __init__(self, message: str, code: int = 0, reason: str = "") -> None:
        super().__init__(message)
        self.code = code
        """Result code of robot_movement_interface (docs/protocol.md); 0 if the server tells none."""
        self.reason = reason
        """The reason in words; empty if the server tells none, as with KRC4 messages."""


class UnknownCommandError(CommandError):
    """The robot answered `unknown command`: the server is older than this client, or of another kind."""


class Krc4Error(CommandError):
    """The robot rejected a KRC4 message."""


class ReplyError(Exception):
    """The reply does not fit the command: client and server are out of step, or the protocol is another."""
