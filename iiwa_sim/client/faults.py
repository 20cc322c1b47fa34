"""What goes wrong on the driver's side besides the connection itself, whose faults are OSError."""


class CommandError(Exception):
    """The robot refused the command, which the message quotes."""


class UnknownCommandError(CommandError):
    """The robot answered `unknown command`: the server is older than this client, or another one."""


class Krc4Error(CommandError):
    """The robot refused a KRC4 message, which alone has a number for the reason."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message, code)
        self.code = code
        """The number of the error, see docs/krc4.md; those from 3000 on are robot_movement_interface's."""

    def __str__(self) -> str:
        return str(self.args[0])


class ReplyError(Exception):
    """The reply does not fit the command: client and server are out of step, or the protocol is another."""
