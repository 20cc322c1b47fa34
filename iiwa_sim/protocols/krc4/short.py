r"""KRC4 messages as one line for people: `Cmd I0=7 I1=100`, answered by `Res I0=7 I1=100 I2=1`.

Values of 0 are left out, except for the ids. A message that this form cannot express, such as one with a
repeated or malformed value, is written verbatim, with characters outside printable ASCII escaped. A line that
begins with the word Cmd or Res is in the short form; a verbatim line that would begin so has its first byte
escaped: `\x43md`.
"""

import re
from collections.abc import Sequence
from html import escape

from iiwa_sim.protocols.krc4.stream import XML_BLANKS, Element
from iiwa_sim.protocols.krc4.table import REPLY, REQUEST
from iiwa_sim.protocols.wire.decimals import format_decimals, readable

NO_MESSAGE = "(no message)"
"""Stands for bytes that are no message and cannot be repeated: too long, or cut short."""

_ROOTS = (REQUEST, REPLY)
_BEGINS = re.compile(rf"(?:{'|'.join(_ROOTS)})(?:\s|\Z)")
_ZEROS = ("0", "0.0")
_REGISTER = re.compile(r"I[2-9]|R[0-9]")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.\-]*")
_VALUE = re.compile(r"[!-\[\]-z|~]*")  # printable ASCII without blanks, backslashes and braces


def is_short(line: str) -> bool:
    """Whether a line is in the short form."""
    return _BEGINS.match(line) is not None


def written(element: Element, wire: bytes) -> str:
    """The line for a message that came as these bytes."""
    values = {name: value.strip(XML_BLANKS) for name, value in element.values.items()}
    told_in_full = not element.fault and element.name in _ROOTS
    if told_in_full and all(_NAME.fullmatch(n) and _VALUE.fullmatch(v) for n, v in values.items()):
        told = [f"{name}={value}" for name, value in values.items() if not _may_be_left_out(name, value)]
        return _line(element.name, told)
    return word_for_word(wire)


def _may_be_left_out(name: str, value: str) -> bool:
    return value in _ZEROS and _REGISTER.fullmatch(name) is not None


def word_for_word(wire: bytes) -> str:
    """The verbatim line for bytes; NO_MESSAGE for none."""
    line = readable(wire)
    if not wire:
        return NO_MESSAGE
    return rf"\x{wire[0]:02x}{readable(wire[1:])}" if is_short(line) or line == NO_MESSAGE else line


def short_reply(integers: Sequence[int], reals: Sequence[float]) -> str:
    """The line for a reply with these integers (from I0) and reals (from R0)."""
    values = [f"I{place}={value}" for place, value in enumerate(integers) if value or place < 2]
    decimals = format_decimals(reals).decode().split() if reals else []
    values += [f"R{place}={value}" for place, value in enumerate(decimals) if value != "0.0"]
    return _line(REPLY, values)


def from_short(line: str) -> Element:
    """The message of a line in the short form. Raises ValueError."""
    root, *words = line.split()
    values: dict[str, str] = {}
    for word in words:
        name, is_value, value = word.partition("=")
        if not (is_value and _NAME.fullmatch(name) and _VALUE.fullmatch(value)):
            raise ValueError(f"'{word}': expected NAME=VALUE, such as I1=100")
        if name in values:
            raise ValueError(f"{name} twice")
        values[name] = value
    return Element(root, values, "")


def to_xml(element: Element) -> bytes:
    """The message as XML bytes, with its values as elements."""
    body = "".join(f"<{name}>{escape(value, quote=False)}</{name}>" for name, value in element.values.items())
    return f"<{element.name}>{body}</{element.name}>".encode()


def _line(root: str, values: Sequence[str]) -> str:
    return " ".join((root, *values))
