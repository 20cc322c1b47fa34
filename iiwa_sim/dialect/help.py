"""The line that `help` answers, written from the protocol table."""

from iiwa_sim.dialect.table import Command, Table

EXAMPLE = "lin move"


def overview(table: Table, example: str = EXAMPLE) -> str:
    """The names of all commands in one line; `example` is one that takes parameters."""
    return f"{', '.join(map(_marked, table.commands.values()))} (help : {example} tells its usage)"


def usage(command: Command) -> str:
    """How to write one command and what it does."""
    return f"{command.usage()}; {command.summary}{' (extension)' if command.extension else ''}"


def alternatives(table: Table, phrase: str) -> str:
    """What to say to someone who asks for a command that is not there: those with these letters, if any."""
    alike = [name for name in table.commands if phrase in name]
    return f"no such command; alike: {', '.join(alike)}" if alike else "no such command"


def _marked(command: Command) -> str:
    return f"{command.name} (extension)" if command.extension else command.name
