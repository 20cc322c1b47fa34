"""What goes wrong on the driver's side besides the connection itself, whose faults are OSError."""


class CommandError(Exception):
    """The robot answered `error`; the message quotes the command."""


class UnknownCommandError(CommandError):
    """The robot answered `unknown command`: the server is older than this client, or another one."""


class ReplyError(Exception):
    """The reply does not fit the command: client and server are out of step, or the protocol is another."""
