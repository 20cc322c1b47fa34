"""Bytes in, XML messages out, however the bytes are split into packets; and messages as lines of text.

Messages follow each other without prefix or separator: a message ends where its root element does. Blanks,
line ends, NUL and byte order marks between messages are skipped. A DTD, and with it every custom entity, is
refused. Bytes that are no XML break the stream: the next message cannot be found. A message that
is valid XML but has unexpected content carries a fault instead.
"""

import re
import tomllib
from collections.abc import Sequence
from typing import Any, NamedTuple
from xml.parsers import expat
from xml.sax.saxutils import escape

from iiwa_sim.protocols.decimals import format_decimals, parse_decimal, quoted, readable
from iiwa_sim.settings import data_folder

MAX_MESSAGE_BYTES = 16384
"""EKI's receive buffer: a longer message breaks the stream."""
XML_BLANKS = " \t\r\n"
"""Characters that XML takes for blanks; no-break spaces and the like are text."""
REGISTERS = 10
"""Integers, and as many reals: a robot with more axes has no place in a message."""
LARGEST_INTEGER = 2**31 - 1
REQUEST, REPLY = "Cmd", "Res"
NO_MESSAGE = "(no message)"
"""Stands for bytes that are no message and cannot be repeated: too long, or cut short."""

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # as .NET writes it before UTF-8
_NOTHING = re.compile(rb"(?:[ \t\r\n\0]+|%b)*" % _BYTE_ORDER_MARK)  # C programs send the \0 of a string, too
_PLACES = {f"{kind}{place}": place for kind in "IR" for place in range(REGISTERS)}
_INTEGER = re.compile(r"[+-]?[0-9]{1,10}")
_SHORT = re.compile(rf"(?:{REQUEST}|{REPLY})(?: [A-Za-z_][A-Za-z0-9_.\-]*=[!-\[\]-z|~]*)*")
_ZERO = re.compile(r"(?:I[2-9]|R[0-9])=0(?:\.0)?")

MESSAGES: dict[str, dict[str, Any]] = tomllib.loads(
    data_folder("iiwa_sim.protocol").joinpath("krc4.toml").read_text("utf-8")
)["command"]
"""The rows of protocol/krc4.toml by tag."""
TAGS: dict[int, str] = {row["id"]: tag for tag, row in MESSAGES.items()}


class Element(NamedTuple):
    """One message: the name of its root, and its values by name, whether attributes or elements."""

    name: str
    values: dict[str, str]
    fault: str
    """Description of content that no message has; empty if there is none."""
    breaks: bool = False
    """True if nothing more can be read from the stream; `fault` is the reason."""


class XmlStream:
    """Splitter of the bytes of one connection into messages."""

    def __init__(self) -> None:
        self._data = b""  # from the beginning of the present message on
        self._ended = False
        self.wire = b""
        """The bytes of what `next` returned last; none if the length or the end of the stream broke it."""
        self._begin()

    def _begin(self) -> None:
        self._parser = parser = expat.ParserCreate("UTF-8")  # whatever a declaration says
        # Expat would otherwise defer a long token that comes in parts until it has twice as much to parse
        if hasattr(parser, "SetReparseDeferralEnabled"):
            parser.SetReparseDeferralEnabled(False)
        parser.StartDoctypeDeclHandler = self._refuse_dtd
        parser.StartElementHandler = self._starts
        parser.CharacterDataHandler = self._text
        parser.EndElementHandler = self._ends
        self._name, self._values, self._fault = "", dict[str, str](), ""
        self._open: list[str] = []  # the elements that have not ended; empty names for unexpected ones
        self._parsed = self._end = 0  # bytes parsed, and those of the message once it has ended

    def receive(self, data: bytes) -> None:
        """Take bytes from the client."""
        self._data += data

    def end(self) -> None:
        """Notice that the client sends no more."""
        self._ended = True

    def next(self) -> Element | None:
        """Return the next message, or one that `breaks` the stream; None if it is incomplete."""
        if not self._parsed:
            self._data = _NOTHING.sub(b"", self._data, 1)
        self.wire = data = self._data[:MAX_MESSAGE_BYTES]
        if not data or (_BYTE_ORDER_MARK.startswith(data) and not self._ended):
            return None
        if not data.startswith(b"<"):
            return Element("", {}, "a message begins with <", True)
        if data[1:2] == b"\0":  # Expat would detect UTF-16 by itself
            return Element("", {}, "expected UTF-8", True)
        try:
            self._parser.Parse(data[self._parsed :], False)
        except expat.ExpatError as fault:
            if not self._end:  # else the fault is behind the message
                return Element("", {}, f"no XML: {expat.ErrorString(fault.code)}", True)
        except ValueError as fault:
            return Element("", {}, str(fault), True)
        self._parsed = len(data)
        if self._end:
            self.wire, self._data = data[: self._end], self._data[self._end :]
            element = Element(self._name, self._values, self._fault)
            self._begin()
            return element
        self.wire = b""
        if len(self._data) > MAX_MESSAGE_BYTES:
            return Element("", {}, f"a message of more than {MAX_MESSAGE_BYTES} bytes", True)
        return Element("", {}, "the stream ends within a message", True) if self._ended else None

    def _refuse_dtd(self, *_: object) -> None:
        raise ValueError("expected no DTD")

    def _starts(self, name: str, attributes: dict[str, str]) -> None:
        if not self._open:
            self._name, self._values = name, attributes
        elif len(self._open) > 1 or attributes or name in self._values:
            self._fault = self._fault or f"{quoted(name.encode())}: expected each value once, with text only"
            name = ""
        else:
            self._values[name] = ""
        self._open.append(name)

    def _text(self, text: str) -> None:
        if len(self._open) == 2 and self._open[1]:
            self._values[self._open[1]] += text
        elif len(self._open) == 1 and text.strip(XML_BLANKS):
            self._fault = self._fault or "text between the values"

    def _ends(self, name: str) -> None:
        self._open.pop()
        if not self._open:
            at = self._parser.CurrentByteIndex  # of an end tag its beginning, of <Cmd/> its end
            is_tag = self._data.startswith(b"</" + name.encode(), at)
            self._end = self._data.find(b">", at) + 1 if is_tag else at


class Message(NamedTuple):
    """A request or a reply with its numbers."""

    integers: tuple[int, ...]
    reals: tuple[float, ...]
    fault: str
    """Why it is malformed, empty if it is not. Integers and reals that could not be read are 0."""

    @property
    def id(self) -> int:
        """Id of the message, which the reply repeats."""
        return self.integers[0]

    @property
    def command(self) -> int:
        """Id of the command."""
        return self.integers[1]


def understand(element: Element, root: str = REQUEST) -> Message:
    """Return the message in an XML element: a request, or a reply if the root is that of one."""
    fault = element.fault
    if not fault and element.name != root:
        fault = f"{quoted(element.name.encode())}: expected {root}"
    integers, reals = [0] * REGISTERS, [0.0] * REGISTERS
    for name, value in element.values.items():
        text, place = value.strip(XML_BLANKS), _PLACES.get(name)
        try:
            if place is None:
                raise ValueError(f"{quoted(text.encode())}: expected I0 to I9 and R0 to R9")
            if name[0] == "I":
                integers[place] = _integer(text)
            else:
                reals[place] = parse_decimal(text.encode())
        except ValueError as wrong:
            fault = fault or f"{quoted(name.encode())} = {wrong}"
    return Message(tuple(integers), tuple(reals), fault)


def _integer(text: str) -> int:
    if not _INTEGER.fullmatch(text) or not -1 - LARGEST_INTEGER <= int(text) <= LARGEST_INTEGER:
        raise ValueError(f"{quoted(text.encode())}: expected an integer of 32 bits")
    return int(text)


def reply_of(integers: Sequence[int], reals: Sequence[float]) -> Element:
    """Return the reply with these integers (from I0) and reals (from R0), zeros elsewhere.

    Raises ValueError for a value that is not finite.
    """
    numbers = map(str, (*integers, *[0] * (REGISTERS - len(integers))))
    decimals = format_decimals((*reals, *[0.0] * (REGISTERS - len(reals)))).decode().split()
    return Element(REPLY, dict(zip(_PLACES, (*numbers, *decimals), strict=True)), "")


def is_short(line: str) -> bool:
    """Return True if a line is in the short form."""
    return line.split(" ", 1)[0] in (REQUEST, REPLY)


def written(element: Element, wire: bytes = b"") -> str:
    """Return the line for a message: short if it can be, else the bytes it came as; NO_MESSAGE for none."""
    values = [f"{name}={value.strip(XML_BLANKS)}" for name, value in element.values.items()]
    line = " ".join((element.name, *(each for each in values if not _ZERO.fullmatch(each))))
    if not element.fault and " " not in "".join(values) and _SHORT.fullmatch(line):
        return line
    if not wire:
        return NO_MESSAGE
    line = readable(wire)
    return rf"\x{wire[0]:02x}{readable(wire[1:])}" if is_short(line) or line == NO_MESSAGE else line


def from_short(line: str) -> Element:
    """Return the message of a line in the short form. Raises ValueError."""
    root, *words = line.split()
    if not _SHORT.fullmatch(" ".join((root, *words))):
        raise ValueError(f"'{line}': expected NAME=VALUE, such as I1=100")
    return Element(root, {name: value for name, _, value in (word.partition("=") for word in words)}, "")


def to_xml(element: Element) -> bytes:
    """Return the message as XML bytes, with its values as elements."""
    body = "".join(f"<{name}>{escape(value)}</{name}>" for name, value in element.values.items())
    return f"<{element.name}>{body}</{element.name}>".encode()
