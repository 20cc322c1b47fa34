"""The pages of errors, options and the Python API."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from html import escape
from importlib import import_module

import iiwa_sim
from iiwa_sim.cli.environment import RULE, variable
from iiwa_sim.cli.names import SUBCOMMANDS
from iiwa_sim.cli.parsing import Parser
from iiwa_sim.cli.server_options import server_parser
from iiwa_sim.dialect.wire.error_codes import load_error_codes
from tools.pages.commands import Page

API = {
    "A robot": ("Simulator", "StillMoving"),
    "Clients": ("Iiwa", "Krc4"),
    "What a client raises": ("CommandError", "UnknownCommandError", "Krc4Error", "ReplyError"),
    "Faults on the wire": (
        *("Pass", "Delay", "Split", "Drop", "Garble", "CloseBefore", "CloseAfter", "ResetBefore", "Silence"),
        *("EVERY", "NEXT", "UNTIL_CLEARED"),
    ),
    "Surfaces": ("PlaneSettings", "BoxSettings", "SphereSettings", "CylinderSettings"),
    "States and frames": ("Snapshot", "Frame"),
    "What cannot be used, or is refused": (
        *("Unusable", "CellFault", "RobotFault", "ListenFault", "TranscriptFault", "HttpFault", "RosFault"),
        "Refused",
    ),
}
"""All of `iiwa_sim.__all__`, in the order of the page."""
BESIDE = {
    "The backdoor": ("iiwa_sim.backdoor.backdoor.Backdoor",),
    "What was said": ("iiwa_sim.remembered.RememberedDialogue", "iiwa_sim.remembered.Exchange"),
}
"""What is had from a `Simulator`."""


def pages() -> list[Page]:
    """All three."""
    return [
        Page("reference/errors.md", errors()),
        Page("reference/options.md", options()),
        Page("reference/python.md", python_api()),
    ]


ERRORS = """# Errors

`get error` answers `CODE reason`; a KRC4 reply has the code in I2; the log tells both. The reason says more
than this page: which joint, which limit, where on the line. On the wire,
`help : 3021` answers what stands here.
"""
OPTIONS = """# Options

{rule} Subcommands take none.
"""
PYTHON = """# Python

All of these are had by `from iiwa_sim import NAME`; a module is loaded when one of its names is asked for.
"""


def errors() -> str:
    """What `get error`, a KRC4 reply or a result on ROS says by a number."""
    text = ERRORS
    for code, row in load_error_codes().items():
        text += f"\n## {code}\n\n**{_sentence(row.meaning)}**\n\n"
        text += f"- Usual cause: {row.cause}.\n- What to do: {row.remedy}.\n"
    return text


def options() -> str:
    """The page of options: those of the program and all its subcommands, as their --help has them."""
    text = OPTIONS.format(rule=RULE)
    parsers = {"iiwa-sim": server_parser()}
    for name in SUBCOMMANDS:
        parsers[f"iiwa-sim {name}"] = import_module(f"iiwa_sim.cli.{name.replace('-', '_')}")._parser()
    for name, parser in parsers.items():
        shown = "\n".join(f"{line}  # {what}" for line, what in parser.examples.items())
        told = [parser.description or "", *_groups(parser), f"```sh\n{shown}\n```", parser.epilog or ""]
        text += f"\n## {name}\n\n" + "\n\n".join(each.strip() for each in told if each) + "\n"
    return text


def _groups(parser: Parser) -> Iterable[str]:
    """A table for each group of options, with the variables of those that can come as one."""
    for title, all_actions in parser.sections():
        actions = [each for each in all_actions if each.dest != "help"]
        if actions and parser.prog == "iiwa-sim":
            rows = [f"| {_spelling(a)} | {_variable(a)} | {_told(a, parser)} |" for a in actions]
            heading = f"### {title[0].upper()}{title[1:]}\n"
            yield "\n".join([heading, "| | variable | |", "|---|---|---|", *rows])
        elif actions:
            rows = [f"| {_spelling(each)} | {_told(each, parser)} |" for each in actions]
            yield "\n".join(["| | |", "|---|---|", *rows])


def _spelling(action: argparse.Action) -> str:
    word = action.metavar or "|".join(map(str, action.choices or ())) or action.dest.upper()
    taken = [] if action.nargs == 0 else [str(word)]
    return _code(" ".join([", ".join(action.option_strings), *taken]).strip())


def _variable(action: argparse.Action) -> str:
    name = variable(action)
    return "" if name is None else _code(name)


def _code(text: str) -> str:
    """Code in a cell of a table, where backticks would not do with a `|` between."""
    return f"<code>{escape(text).replace('|', '&#124;')}</code>"


def _told(action: argparse.Action, parser: Parser) -> str:
    told = (action.help or "") % {"default": action.default, "prog": parser.prog}
    return escape(told, quote=False).replace("|", "&#124;").replace("*", "&#42;")


def python_api() -> str:
    """Written out by mkdocstrings."""
    text = PYTHON
    for title, names in API.items():
        text += f"\n## {title}\n" + "".join(f"\n::: {iiwa_sim._HOME_OF[name]}.{name}\n" for name in names)
    text += "\nWhat a `Simulator` has:\n"
    for title, names in BESIDE.items():
        text += f"\n## {title}\n" + "".join(f"\n::: {name}\n" for name in names)
    return text


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."
