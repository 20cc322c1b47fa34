"""Command lines: options of the model, and arguments that one command has of its own."""

import argparse
import os
import re
from collections.abc import Container, Iterable, Sequence
from functools import partial
from itertools import groupby
from typing import NoReturn

from iiwa_sim.cli import COMMANDS
from iiwa_sim.options.model import NEEDS, SettingError
from iiwa_sim.options.sources import COMMAND_LINE, OPTIONS, Given, read, unknown
from iiwa_sim.protocols.ports import MAX_PORT
from iiwa_sim.wording import harmless, shortened

LONGEST_MESSAGE = 400
"""Most characters of a message about wrong arguments, which quotes them."""
FORMATTER = partial(argparse.RawDescriptionHelpFormatter, width=100)
TITLE = """A robot controller in software that speaks the text protocol of the KUKA LBR iiwa, and the messages
of a KUKA KRC4. To talk to it: telnet HOST PORT, then help"""
EXAMPLES = """examples:
  iiwa-sim                                         an LBR iiwa 7 on port 30000 of this machine
  iiwa-sim examples/table.toml --clock fast        one at a table, in simulated time as fast as possible
  iiwa-sim --robot kr_6_r900_sixx --protocol krc4  a KR 6 that speaks KRC4 messages
"""
ENVIRONMENT_RULE = """\
Each option can also come as an environment variable: --clock fast as IIWA_SIM_CLOCK=fast, --strict
as IIWA_SIM_STRICT=1 (or true; 0, false), CELL.toml as IIWA_SIM_CELL. The command line comes before
the environment."""


class Parser(argparse.ArgumentParser):
    """Command line parser of the model's options; a wrong command line is a SettingError of one line."""

    def __init__(self, command: str, text: str, closing: str, usage: str | None = None) -> None:
        prog = f"iiwa-sim {command}".rstrip()
        super().__init__(prog, usage, text, closing, formatter_class=FORMATTER, allow_abbrev=False)
        self.argument_default = argparse.SUPPRESS

    def add_options(self, fields: Iterable[str], shown: Container[str] = OPTIONS) -> None:
        """Add options of the model, each in its group; --help lists those that are `shown`."""
        for title, options in groupby(map(OPTIONS.__getitem__, fields), lambda option: option.group):
            group = self.add_argument_group(title)
            for option in options:
                flag, kind = option.flag, {"dest": option.keyword, "metavar": option.metavar}
                if option.is_switch:
                    kind = {"dest": option.keyword, "action": "store_const", "const": "true"}
                elif option.keyword == "cell":
                    flag, kind = "cell", {"nargs": "?", "metavar": option.metavar}
                limits = option.expected if "number" in option.expected and option.metavar != "PORT" else ""
                notes = "; ".join(filter(None, (limits, option.unset and f"default: {option.unset}")))
                text = f"{option.text} ({notes})" if notes else option.text
                kind["help"] = text if option.keyword in shown else argparse.SUPPRESS
                group.add_argument(flag, **kind)

    def parsed(self, words: Sequence[str]) -> tuple[argparse.Namespace, Given]:
        """Return the arguments of the command's own, and the options of the model. Raises SettingError."""
        found, surplus = self.parse_known_args(words)
        for word in surplus:
            if not word.startswith("-"):
                raise SettingError(f"{harmless(shortened(word, 60))}: unexpected argument")
            flags = [name for action in self._actions for name in action.option_strings]
            if (flag := word.partition("=")[0]) == "--cell" and self.prog == "iiwa-sim":
                raise SettingError("--cell: no such option, name the file alone: iiwa-sim CELL.toml")
            raise unknown(flag, flags)
        texts = {field: vars(found).pop(field) for field in OPTIONS if field in found}
        return found, {field: read(OPTIONS[field], text, COMMAND_LINE) for field, text in texts.items()}

    def error(self, message: str) -> NoReturn:
        raise SettingError(shortened(harmless(message.removeprefix("argument ")), LONGEST_MESSAGE))


def from_command_line(words: Sequence[str]) -> Given:
    """Return the options on a command line of `iiwa-sim` without a command. Raises SettingError."""
    cell = words[0] if words and not words[0].startswith("-") else ""
    if cell and not cell.endswith(".toml") and not os.path.exists(cell):  # noqa: PTH110 - raises nothing
        raise unknown(cell, [*COMMANDS, "--help", "--version"], "no file and no command")
    commands = "".join(f"  {name:<16}  {what}\n" for name, what in COMMANDS.items())
    closing = f"commands (see iiwa-sim COMMAND --help):\n{commands}\n{EXAMPLES}\n{ENVIRONMENT_RULE}"
    parser = Parser("", TITLE, closing, "iiwa-sim [CELL.toml] [OPTION ...]")
    parser.add_argument("--help-all", action="help", help="list all options and exit")
    parser.add_argument("--version", action="store_true", help="print the version and exit")
    rare = "" if "--help-all" in words else " ".join(NEEDS)
    parser.add_options(OPTIONS, OPTIONS.keys() - rare.split())
    return parser.parsed(words)[1]


def server(text: str, most: int = 2) -> tuple[str, list[int]]:
    """Return host and up to `most` ports of HOST:PORT[,PORT], or of a URL. Raises ArgumentTypeError."""
    found = re.fullmatch(r"(?:\w+://)?\[?(.+?)\]?:([0-9]{1,5}(?:,[0-9]{1,5})*)/?", text)
    ports = [int(port) for port in found[2].split(",")] if found else []
    if found is None or len(ports) > most or not 1 <= min(ports) <= max(ports) <= MAX_PORT:
        raise argparse.ArgumentTypeError(f"{shortened(repr(text), 40)} is not HOST:PORT")
    return found[1], ports


def reached_at(host: str) -> str:
    """Return the address on this machine of a server that listens on `host`."""
    return {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)  # among all addresses
