"""How options are told and checked; loads nothing that takes its time, for who is started often."""

import argparse
from collections.abc import Callable
from typing import NoReturn

from iiwa_sim.wording import harmless, shortened

LONGEST_MESSAGE = 400
"""Characters of a message about wrong arguments, which cites them."""

Error = Callable[[str], NoReturn]
"""Ends the program with a message of one line, and exit code 2."""


class Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    @property
    def options(self) -> list[argparse.Action]:
        """All that can be given, with --help."""
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
