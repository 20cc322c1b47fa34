"""Write docs/options.md from the model of options: python -m tools.options."""

from html import escape
from itertools import groupby
from pathlib import Path

from iiwa_sim.cli import COMMANDS
from iiwa_sim.cli.parsing import ENVIRONMENT_RULE
from iiwa_sim.options.model import PROCESS
from iiwa_sim.options.sources import OPTIONS, Option

PAGE = Path(__file__).parent.parent / "docs" / "options.md"
HEAD = """# Options

`python -m tools.options` writes this page.

{rule} An empty variable counts as not set.

A key of a [fleet file](fleets.md) is the option's name with `_` for `-`. The column *keyword* names the
argument of `Simulator`, of `Settings` and of the marker `iiwa`. The whole process has one value of an option
without a keyword.
"""
GROUP = """
## {title}

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
    text = HEAD.format(rule=ENVIRONMENT_RULE)
    for title, options in groupby(OPTIONS.values(), lambda option: option.group):
        text += GROUP.format(title=f"{title[0].upper()}{title[1:]}") + "".join(map(_row, options))
    return text + END + "".join(f"| `iiwa-sim {name}` | {what} |\n" for name, what in COMMANDS.items())


def _row(option: Option) -> str:
    keyword = "" if option.key in PROCESS - {"ros"} else f"`{option.keyword}`"
    value = option.metavar if "a text" in option.expected else "" if option.is_switch else option.expected
    default = "" if option.is_switch else option.unset
    flag = f"`{option.flag}`" if option.flag.startswith("-") else option.flag
    return f"| {flag} | {keyword} | {_cell(value)} | {_cell(default)} | {_cell(option.text)} |\n"


def _cell(text: str) -> str:
    return escape(text, quote=False).replace("|", "&#124;")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
