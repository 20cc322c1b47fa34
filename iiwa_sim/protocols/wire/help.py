"""The line that `help` answers, written from the protocol table and that of error codes."""

from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, Refused
from iiwa_sim.protocols.wire.command import Command
from iiwa_sim.protocols.wire.error_codes import load_error_codes
from iiwa_sim.protocols.wire.table import Table

EXTENSIONS = "extensions"
"""`help : extensions` names the commands that the original does not know."""


def helped(table: Table, phrase: str, example: str) -> str:
    """What `help : PHRASE` answers: the usage of that command, or the names that are like the phrase.

    Of an error code it tells meaning, usual cause and what to do. Without a phrase the commands are named,
    for `extensions` those that are some; `example` is one that takes parameters. Raises `Refused` where no
    name is like the phrase, and for a number that is no code.
    """
    if not phrase:
        return _overview(table, example)
    if phrase.lower() == EXTENSIONS:
        return f"{EXTENSIONS}: {_named(table, extensions=True) or 'none'}"
    if phrase.isdecimal():
        return _error_code(phrase)
    command = table.commands.get(phrase.lower())
    if command is not None:
        return _usage(command)
    alike = _alike(table, phrase.lower())
    if not alike:
        raise Refused(COMMUNICATION_FAILURE, "no such command")
    return f"alike: {alike}"


def _overview(table: Table, example: str) -> str:
    """The names of the commands in one line, and how to learn more."""
    more = f", help : {EXTENSIONS} more of them" if _named(table, extensions=True) else ""
    hint = f"help : {example} tells its usage{more}, help : 3021 what a code of get error means"
    return f"{_named(table, extensions=False)} ({hint})"


def _named(table: Table, *, extensions: bool) -> str:
    return ", ".join(command.name for command in table.commands.values() if command.extension is extensions)


def _error_code(phrase: str) -> str:
    """What a code means."""
    codes = load_error_codes()
    for code, row in codes.items():
        if phrase == str(code):
            return row.told(code)
    raise Refused(COMMUNICATION_FAILURE, f"no such error code: there are {', '.join(map(str, codes))}")


def _usage(command: Command) -> str:
    """How to write one command and what it does."""
    return f"{command.usage()}; {command.summary}{' (extension)' if command.extension else ''}"


def _alike(table: Table, phrase: str) -> str:
    """The names of commands with these letters, or of the one that differs in a letter; empty for none."""
    return ", ".join(name for name in table.commands if phrase in name) or table.meant(phrase.encode()) or ""
