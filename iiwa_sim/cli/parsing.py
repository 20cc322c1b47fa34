"""Parsing of options. Imports nothing that loads slowly, for commands that are started often."""

import argparse
from collections.abc import Callable
from typing import NoReturn

from iiwa_sim.wording import harmless, shortened

LONGEST_MESSAGE = 400
"""Most characters of a message about wrong arguments, which quotes them."""

Error = Callable[[str], NoReturn]
"""Ends the program with a message of one line, and exit code 2."""


class Parser(argparse.ArgumentParser):
    """An argument parser whose error messages are one line."""

    @property
    def options(self) -> list[argparse.Action]:
        """All options, --help among them."""
        return list(self._actions)

    def error(self, message: str) -> NoReturn:
        told = shortened(harmless(message), LONGEST_MESSAGE)
        self.exit(2, f"{self.prog}: {told} (see {self.prog} --help)\n")

    def print_help(self, _file: object = None) -> None:
        from iiwa_sim.cli.output import say

        say(self.format_help())


def whole(low: int, high: int) -> Callable[[str], int]:
    def whole_number(text: str) -> int:
        if not (text.isascii() and text.isdigit() and len(text) < 10 and low <= int(text) <= high):
            shown = shortened(repr(text), 40)
            raise argparse.ArgumentTypeError(f"{shown} is not a whole number from {low} to {high}")
        return int(text)

    return whole_number
