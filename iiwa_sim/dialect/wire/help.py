"""The line that `help` answers, written from the protocol table."""

from iiwa_sim.dialect.wire.table import Command, Table

EXAMPLE = "lin move"


def overview(table: Table, example: str = EXAMPLE) -> str:
    """The names of all commands in one line; `example` is one that takes parameters."""
    names = ", ".join(command.name for command in table.commands.values() if not command.extension)
    extensions = ", ".join(command.name for command in table.commands.values() if command.extension)
    if extensions:
        names = f"commands: {names}; extensions: {extensions}"
    return f"{names} (help : {example} tells its usage)"


def usage(command: Command) -> str:
    """How to write one command and what it does."""
    return f"{command.usage()}; {command.summary}{' (extension)' if command.extension else ''}"


def alike(table: Table, phrase: str) -> str:
    """The names of commands with these letters, or of the one that differs in a letter; empty for none."""
    return ", ".join(name for name in table.commands if phrase in name) or table.meant(phrase.encode()) or ""
