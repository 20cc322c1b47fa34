"""Write pages of reference in docs/ from the code: python -m tools.reference."""

from html import escape
from itertools import chain, groupby
from pathlib import Path

from iiwa_sim.backdoor.http import CALLS
from iiwa_sim.cli import COMMANDS
from iiwa_sim.cli.parsing import ENVIRONMENT_RULE
from iiwa_sim.options.model import PROCESS
from iiwa_sim.options.sources import OPTIONS, Option
from iiwa_sim.protocols.table import Command, Quantity, load_error_codes, load_table

DOCS = Path(__file__).parent.parent / "docs"
WRITTEN = "`python -m tools.reference` writes this page."
HEAD = """# Options

{written} {rule} An empty variable counts as not set.

A key of a [fleet file](howto.md#run-many-robots) is the option's name with `_` for `-`. The column *keyword*
names the argument of `Simulator`, of `Settings` and of the marker `iiwa`. The whole process has one value of
an option without a keyword.
"""
TABLE = """
| option | keyword | value | default | |
|---|---|---|---|---|
"""
COMMANDS_HEAD = """# Commands

{written} (*) is an extension: the real robot does not have it.
Values in brackets may be left out, all or none. Each command may also answer `error`.
[Values](#values) have their units and ranges below.

| command | what it does | reply |
|---|---|---|
"""
VALUES_HEAD = """
## Values

Joint positions and r have the limits of the robot.

| value | unit | range | |
|---|---|---|---|
"""
ERRORS_HEAD = """# Errors

{written} `get error` answers `CODE reason`. A KRC4 reply has the code in I2. The log has both.

| code | meaning | usual cause | what to do |
|---|---|---|---|
"""
END = """
## Commands

`iiwa-sim COMMAND --help` tells the options of a command.

| | |
|---|---|
"""


def commands() -> str:
    """Return the page of the text protocol's commands."""
    table = load_table("iiwa").commands.values()
    text = COMMANDS_HEAD.format(written=WRITTEN) + "".join(map(_command, table))
    values = chain.from_iterable((*each.parameters, *each.optional, *each.reply.values) for each in table)
    rows = {each.name: _value(each) for each in values}
    return text + VALUES_HEAD + "".join(rows.values())


def _command(command: Command) -> str:
    takes = [each.name for each in command.parameters] + [f"({each.name})" for each in command.optional]
    line = " ".join(
        [
            command.name,
            *([":", *filter(None, [command.phrase.upper()])] if command.phrase or takes else []),
            *takes,
        ]
    )
    words = command.reply.words or (" ".join(each.name for each in command.reply.values),)
    reply = ", ".join(f"`{word}`" for word in words if word) or "text"
    return f"| `{line}`{'*' if command.extension else ''} | {_cell(command.summary)} | {reply} |\n"


def _value(value: Quantity) -> str:
    unit = "" if value.unit == "1" else value.unit
    return f"| `{value.name}` | {unit} | {_cell(value.range)} | {_cell(value.meaning)} |\n"


def errors() -> str:
    """Return the page of the error codes."""
    rows = load_error_codes().items()
    return ERRORS_HEAD.format(written=WRITTEN) + "".join(
        f"| {code} | {_cell(row.meaning)} | {_cell(row.cause)} | {_cell(row.remedy)} |\n"
        for code, row in rows
    )


def options() -> str:
    """Return the page of the options."""
    text = HEAD.format(written=WRITTEN, rule=ENVIRONMENT_RULE) + TABLE
    for title, options in groupby(OPTIONS.values(), lambda option: option.group):
        text += f"| **{title[0].upper()}{title[1:]}** | | | | |\n" + "".join(map(_row, options))
    return text + END + "".join(f"| `iiwa-sim {name}` | {what} |\n" for name, what in COMMANDS.items())


def _row(option: Option) -> str:
    keyword = "" if option.keyword in PROCESS else f"`{option.keyword}`"
    value = option.metavar if "a text" in option.expected else "" if option.is_switch else option.expected
    flag = f"`{option.flag}`" if option.flag.startswith("-") else option.flag
    return f"| {flag} | {keyword} | {_cell(value)} | {_cell(option.unset)} | {_cell(option.text)} |\n"


def _cell(text: str) -> str:
    return escape(text, quote=False).replace("|", "&#124;")


def backdoor() -> str:
    """Return the text of the page on the backdoor, with the table of its calls as they are."""
    text = (DOCS / "backdoor.md").read_text(encoding="utf-8")
    begin, end = "writes this table. -->\n", "<!-- End of calls. -->"
    rows = "".join(
        f"| `{name}({', '.join(call.takes)})` | {'GET' if call.reads else ''} | {_cell(call.summary)} |\n"
        for name, call in CALLS.items()
    )
    before, after = text.partition(begin)[0], text.partition(end)[2]
    return f"{before}{begin}\n| call | | |\n|---|---|---|\n{rows}\n{end}{after}"


PAGES = {"commands": commands, "errors": errors, "options": options, "backdoor": backdoor}

if __name__ == "__main__":
    for name, page in PAGES.items():
        (DOCS / f"{name}.md").write_text(page(), encoding="utf-8")
