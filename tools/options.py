"""Write docs/options.md and the table of docs/backdoor.md from the code: python -m tools.options."""

from html import escape
from itertools import groupby
from pathlib import Path

from iiwa_sim.backdoor.http import CALLS
from iiwa_sim.cli import COMMANDS
from iiwa_sim.cli.parsing import ENVIRONMENT_RULE
from iiwa_sim.options.model import PROCESS
from iiwa_sim.options.sources import OPTIONS, Option

PAGE = Path(__file__).parent.parent / "docs" / "options.md"
BACKDOOR = PAGE.with_name("backdoor.md")
HEAD = """# Options

`python -m tools.options` writes this page. {rule} An empty variable counts as not set.

A key of a [fleet file](howto.md#run-many-robots) is the option's name with `_` for `-`. The column *keyword*
names the argument of `Simulator`, of `Settings` and of the marker `iiwa`. The whole process has one value of
an option without a keyword.
"""
TABLE = """
| option | keyword | value | default | |
|---|---|---|---|---|
"""
END = """
## Commands

`iiwa-sim COMMAND --help` tells the options of a command.

| | |
|---|---|
"""


def page() -> str:
    """Return the text of the page."""
    text = HEAD.format(rule=ENVIRONMENT_RULE) + TABLE
    shown = (option for option in OPTIONS.values() if option.group != "other options")
    for title, options in groupby(shown, lambda option: option.group):
        text += f"| **{title[0].upper()}{title[1:]}** | | | | |\n" + "".join(map(_row, options))
    return text + END + "".join(f"| `iiwa-sim {name}` | {what} |\n" for name, what in COMMANDS.items())


def _row(option: Option) -> str:
    keyword = "" if option.key in PROCESS - {"ros"} else f"`{option.keyword}`"
    value = option.metavar if "a text" in option.expected else "" if option.is_switch else option.expected
    default = "" if option.is_switch else option.unset
    flag = f"`{option.flag}`" if option.flag.startswith("-") else option.flag
    return f"| {flag} | {keyword} | {_cell(value)} | {_cell(default)} | {_cell(option.text)} |\n"


def _cell(text: str) -> str:
    return escape(text, quote=False).replace("|", "&#124;")


def backdoor() -> str:
    """Return the text of the page on the backdoor, with the table of its calls as they are."""
    text = BACKDOOR.read_text(encoding="utf-8")
    begin, end = "writes this table. -->\n", "<!-- End of calls. -->"
    rows = "".join(
        f"| `{name}({', '.join(call.takes)})` | {'GET' if call.reads else ''} | {_cell(call.summary)} |\n"
        for name, call in CALLS.items()
    )
    before, after = text.partition(begin)[0], text.partition(end)[2]
    return f"{before}{begin}\n| call | | |\n|---|---|---|\n{rows}\n{end}{after}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    BACKDOOR.write_text(backdoor(), encoding="utf-8")
