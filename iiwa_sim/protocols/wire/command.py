"""A command of a protocol table: what it takes, in which ranges, and how that is told."""

from collections.abc import Sequence
from math import inf, nextafter
from typing import NamedTuple

from iiwa_sim.protocols.wire.decimals import NotANumberError, parse_decimal, quoted

BETWEEN_PHRASES = "="
"""Stands in a line between two phrases of one command."""


class Quantity(NamedTuple):
    """A number on the wire: `above < value`, `minimum <= value`, `value <= maximum` where they are given."""

    name: str
    unit: str
    meaning: str
    above: float | None
    minimum: float | None
    maximum: float | None
    integer: bool

    @property
    def range(self) -> str:
        """The range as an inequality, such as `0 < speed <= 1`; empty where the table gives none."""
        low = f"{self.above:g} < " if self.above is not None else ""
        low = f"{self.minimum:g} <= " if self.minimum is not None else low
        high = f" <= {self.maximum:g}" if self.maximum is not None else ""
        return f"{low}{self.name}{high}" if low or high else ""

    @property
    def bounds(self) -> tuple[float, float]:
        """The least and the greatest value, both in range; both finite."""
        low = nextafter(-inf, 0.0) if self.minimum is None else self.minimum
        if self.above is not None:
            low = max(low, nextafter(self.above, inf))
        return low, nextafter(inf, 0.0) if self.maximum is None else self.maximum

    def refusal(self, word: bytes) -> str:
        """Why a word is refused that is no number in range."""
        try:
            value = parse_decimal(word)
        except NotANumberError as fault:
            return f"{self.name} = {fault}{commas(word)}"
        if self.integer and value != int(value):
            return f"{self.name} = {quoted(word)}: expected a whole number"
        parts = (
            f"above {self.above:g}" if self.above is not None else "",
            f"at least {self.minimum:g}" if self.minimum is not None else "",
            f"up to {self.maximum:g}" if self.maximum is not None else "",
        )
        return f"{self.name} = {quoted(word)}: expected {' and '.join(part for part in parts if part)}"


class Command(NamedTuple):
    """One command of the table.

    It takes numbers (`parameters`, and `optional` ones, all or none of them), words (`phrase` names them),
    words and then numbers, or nothing. `phrase` may name two, as `command = reply`, which a line has in the
    same form. It answers one of `reply_words`, numbers (`reply_values`), any number
    of the same (`reply_list`) or a line of prose.
    """

    name: str
    summary: str
    mode: str
    requirements: tuple[str, ...]
    extension: bool
    parameters: tuple[Quantity, ...]
    phrase: str
    reply_words: tuple[str, ...]
    reply_values: tuple[Quantity, ...]
    optional: tuple[Quantity, ...]
    reply_list: Quantity | None

    @property
    def phrases(self) -> tuple[str, ...]:
        """The names of its phrases, in the order of a line."""
        return tuple(each.strip() for each in self.phrase.split(BETWEEN_PHRASES)) if self.phrase else ()

    def takes(self) -> str:
        """The parameters of the command by name and number: `x y z speed: 4 values`."""
        names = [each.name for each in _in_series(self.parameters)]
        names += [f"({each.name})" for each in self.optional]
        more = f" or {len(self.parameters) + len(self.optional)}" if self.optional else ""
        phrase = f"{self.phrase} and " if self.phrase else ""
        plural = "" if len(self.parameters) == 1 and not more else "s"
        return f"{phrase}{' '.join(names)}: {len(self.parameters)}{more} value{plural}"

    def usage(self) -> str:
        """How to write the command, with units and ranges, and what it answers."""
        takes = " ".join(f"{each.name}[{_unit_and_range(each)}]" for each in _in_series(self.parameters))
        takes += "".join(f" ({each.name}[{_unit_and_range(each)}])" for each in self.optional)
        takes = " ".join(part for part in (f"[{self.phrase}]" if self.phrase else "", takes) if part)
        gives = " ".join(f"{each.name}[{each.unit}]" for each in _in_series(self.reply_values))
        if self.reply_list is not None:
            gives = f"{self.reply_list.name}[{_unit_and_range(self.reply_list)}] ..."
        gives = gives or " / ".join(self.reply_words) or "text"
        return f"{self.name}{' : ' if takes else ''}{takes} -> {gives}"


def _in_series(quantities: Sequence[Quantity]) -> list[Quantity]:
    """The quantities, with j0 to j6 merged into `j0..j6` where they differ only in their number."""
    series: list[list[Quantity]] = []
    for each in quantities:
        if series and _follows(series[-1][-1], each):
            series[-1].append(each)
        else:
            series.append([each])
    return [
        run[0] if len(run) == 1 else run[0]._replace(name=f"{run[0].name}..{run[-1].name}") for run in series
    ]


def _follows(one: Quantity, other: Quantity) -> bool:
    stem = one.name.rstrip("0123456789")
    number = one.name.removeprefix(stem)
    return (
        number != ""
        and other.name == f"{stem}{int(number) + 1}"
        and one._replace(name="", meaning="") == other._replace(name="", meaning="")
    )


def _unit_and_range(quantity: Quantity) -> str:
    unit = "" if quantity.unit == "1" else quantity.unit
    return ", ".join(part for part in (unit, quantity.range) if part)


def commas(text: bytes) -> str:
    """A hint for parameters with commas."""
    return "; no commas: blanks between values, a point in a decimal" if b"," in text else ""
