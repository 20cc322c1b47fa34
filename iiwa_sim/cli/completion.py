"""`iiwa-sim completion`: a script that completes commands and options in a shell."""

import argparse
from collections.abc import Sequence
from importlib import import_module

from iiwa_sim.cli.names import COMPLETION, SUBCOMMANDS, module_of, summaries
from iiwa_sim.cli.output import say
from iiwa_sim.cli.parsing import Parser
from iiwa_sim.wording import Unusable

SHELLS = ("bash", "zsh")
FILES = ("file", "folder", "toml", "mcap", "picture", "commands")
"""An option takes a file where one of these is in the name of its value, such as CELL.toml."""


class CompletionFault(Unusable):
    """The library that writes the script is not installed. The message is one line."""


def run(given: Sequence[str]) -> int:
    options = _parser().parse_args(given)
    try:
        import shtab
    except ModuleNotFoundError as fault:
        if fault.name != "shtab":
            raise
        raise CompletionFault("completion needs shtab: pip install 'iiwa-sim[completion]'") from None
    script: str = shtab.complete(_all_commands(shtab.FILE), options.shell)
    say(f"{script}\n")
    return 0


def _all_commands(file: object) -> argparse.ArgumentParser:
    """One parser for all commands, as shtab wants it; values that are files are completed by `file`."""
    from iiwa_sim.cli.server_options import server_parser

    whole = argparse.ArgumentParser(prog="iiwa-sim", add_help=False)
    _take(whole, server_parser(), file)
    told = summaries()
    commands = whole.add_subparsers(metavar="COMMAND")
    for name in SUBCOMMANDS:
        own: Parser = import_module(module_of(name))._parser()
        _take(commands.add_parser(name, help=told[name], add_help=False), own, file)
    return whole


def _take(whole: argparse.ArgumentParser, parser: Parser, file: object) -> None:
    """Give `whole` the options of a parser, and its positional arguments but for what a command replaces."""
    for action in parser.options:
        if not action.option_strings and parser.prog == "iiwa-sim":
            continue  # CELL.toml stands where the name of a command does
        if any(word in str(action.metavar).lower() for word in FILES):
            action.complete = file  # type: ignore[attr-defined]
        whole._add_action(action)


def _parser() -> Parser:
    parser = Parser(
        prog=f"iiwa-sim {COMPLETION}",
        description="Prints a script that completes commands, options and files in a shell.",
        examples={"bash > ~/.local/share/bash-completion/completions/iiwa-sim": "for all shells to come"},
    )
    parser.add_argument("shell", choices=SHELLS, help="which one")
    return parser
