"""The line that `help` answers, written from the protocol table."""

from collections.abc import Container

from iiwa_sim.dialect.table import Command, Table


def overview(table: Table, available: Container[str]) -> str:
    """All commands in one line; extensions, and what this version cannot do, in lists of their own."""
    usable = [each for each in table.commands.values() if each.name in available]
    lists = {
        "commands": [each.name for each in usable if not each.extension],
        "extensions": [each.name for each in usable if each.extension],
        "not available in this version": [name for name in table.commands if name not in available],
    }
    return "; ".join(f"{title}: {', '.join(names)}" for title, names in lists.items() if names)


def usage(command: Command, available: Container[str]) -> str:
    """How to write one command and what it does."""
    marks = "" if command.name in available else " (not available in this version)"
    marks += " (extension)" if command.extension else ""
    return f"{command.usage()}; {command.summary}{marks}"
