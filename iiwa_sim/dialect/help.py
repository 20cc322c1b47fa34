"""The line that `help` answers, written from the protocol table."""

from collections.abc import Container

from iiwa_sim.dialect.table import Command, Table

_HINT = "(help : lin move tells its usage)"


def overview(table: Table, available: Container[str]) -> str:
    """The names of all commands in one line, those that this version cannot carry out at its end."""
    usable = [_marked(each) for each in table.commands.values() if each.name in available]
    others = [_marked(each) for each in table.commands.values() if each.name not in available]
    return ", ".join(usable) + (f"; not yet: {', '.join(others)}" if others else "") + f" {_HINT}"


def usage(command: Command, available: Container[str]) -> str:
    """How to write one command and what it does."""
    marks = "" if command.name in available else " (not available in this version)"
    marks += " (extension)" if command.extension else ""
    return f"{command.usage()}; {command.summary}{marks}"


def alternatives(table: Table, phrase: str) -> str:
    """What to say to someone who asks for a command that is not there: those with these letters, if any."""
    alike = [name for name in table.commands if phrase in name]
    return f"no such command; alike: {', '.join(alike)}" if alike else "no such command"


def _marked(command: Command) -> str:
    return f"{command.name} (extension)" if command.extension else command.name
