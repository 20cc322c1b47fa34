"""Parsing of options. Imports nothing that loads slowly, for commands that are started often."""

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple, NoReturn

from iiwa_sim.wording import harmless, shortened

LONGEST_MESSAGE = 400
"""Most characters of a message about wrong arguments, which quotes them."""

Error = Callable[[str], NoReturn]
"""Ends the program with a message of one line, and exit code 2."""


class Section(NamedTuple):
    """Options that belong together, for --help and the page of options."""

    title: str
    actions: list[argparse.Action]


class Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, and in --help what belongs together, with examples."""

    def __init__(
        self,
        *,
        prog: str,
        description: str = "",
        examples: Mapping[str, str] | None = None,
        usage: str | None = None,
        epilog: str | None = None,
        sections: Mapping[str, str] | None = None,
        commands: Callable[[], Mapping[str, str]] = dict,
    ) -> None:
        """`examples` are command lines, each with what it does, without the program's name.

        `sections` are titles with the names of options, as they are attributes: `log` is also for `log_level`
        and `log_json`. What is in none has one of its own at the end. `commands` gives what else the program
        does, by the word behind its name.
        """
        super().__init__(prog=prog, usage=usage, description=description, epilog=epilog, allow_abbrev=False)
        self.examples = {f"{prog} {line}".rstrip(): what for line, what in (examples or {}).items()}
        self._section_words = sections or {}
        self._commands = commands

    @property
    def options(self) -> list[argparse.Action]:
        """All options, --help among them."""
        return list(self._actions)

    def sections(self) -> list[Section]:
        """All options, those that belong together in one."""
        left = self.options
        found = []
        for title, words in self._section_words.items():
            own = [each for word in words.split() for each in left if _is_of(word, each.dest)]
            left = [each for each in left if each not in own]
            found.append(Section(title, own))
        given = [each for each in left if not each.option_strings]
        rest = [each for each in left if each.option_strings]
        found += [Section("arguments", given), Section("other options" if found else "options", rest)]
        return [section for section in found if section.actions]

    def format_help(self) -> str:
        """Usage, sections, commands, examples."""
        formatter = self._get_formatter()
        formatter.add_usage(self.usage, self._actions, self._mutually_exclusive_groups)
        formatter.add_text(self.description)
        for title, actions in self.sections():
            formatter.start_section(title)
            formatter.add_arguments(actions)
            formatter.end_section()
        text = formatter.format_help()
        for title, rows in (("commands", self._commands()), ("examples", self.examples)):
            if rows:
                width = max(map(len, rows))
                text += f"\n{title}:\n" + "".join(f"  {row:<{width}}  {what}\n" for row, what in rows.items())
        closing = self._get_formatter()
        closing.add_text(self.epilog)
        return f"{text}\n{closing.format_help()}" if self.epilog else text

    def error(self, message: str) -> NoReturn:
        told = shortened(harmless(message), LONGEST_MESSAGE)
        self.exit(2, f"{self.prog}: {told} (see {self.prog} --help)\n")

    def print_help(self, _file: object = None) -> None:
        from iiwa_sim.cli.output import say

        say(self.format_help())


def _is_of(word: str, name: str) -> bool:
    return name == word or name.startswith(f"{word}_")


def whole(low: int, high: int) -> Callable[[str], int]:
    def whole_number(text: str) -> int:
        if not (text.isascii() and text.isdigit() and len(text) < 10 and low <= int(text) <= high):
            shown = shortened(repr(text), 40)
            raise argparse.ArgumentTypeError(f"{shown} is not a whole number from {low} to {high}")
        return int(text)

    return whole_number


def path(text: str) -> Path:
    """A file or a folder; an empty text, which a shell makes of an unset variable, would be this folder."""
    if not text:
        raise argparse.ArgumentTypeError("expected a name, not an empty text")
    return Path(text)
