"""Bytes in, XML messages out, however the bytes are split into packets.

Messages follow each other without prefix or separator: a message ends where its root element does. Blanks,
line ends, NUL and byte order marks between messages are skipped. Expat is fed up to each `>`, so the end of
the root is the end of the fed bytes. A DTD, and with it every custom entity, is refused in time.

Bytes that are no XML give no way to find the next message, so the stream is broken from there on. A message
that is valid XML but has unexpected content carries a fault instead.
"""

import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Literal, NamedTuple
from xml.parsers import expat
from xml.sax.saxutils import escape

import msgspec

from iiwa_sim.protocols.decimals import NotANumberError, format_decimals, parse_decimal, quoted, readable
from iiwa_sim.settings import data_folder

MAX_MESSAGE_BYTES = 16384
"""EKI's receive buffer: a longer message breaks the stream."""
MAX_ENDS = 100
"""Most `>` in a message; one with more breaks the stream. A message with all twenty values has 42. Each
`>` costs a scan of the open elements: without a bound 16 KiB would delay the robot by 0.2 s."""

XML_BLANKS = " \t\r\n"
"""Characters that XML takes for blanks; no-break spaces and the like are text."""

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # as .NET writes it before UTF-8
_NOTHING = re.compile(rb"(?:[ \t\r\n\0]+|%b)*" % _BYTE_ORDER_MARK)  # C programs send the \0 of a string, too


class Element(NamedTuple):
    """One message: the name of its root, and its values by name, whether attributes or elements."""

    name: str
    values: dict[str, str]
    fault: str
    """Description of content that no message has; empty if there is none."""


class Broken(Exception):
    """The stream has ended or is broken: nothing more can be read. The message tells why."""


class XmlStream:
    """Splits the bytes of one connection into messages."""

    def __init__(self) -> None:
        self._data = b""  # from the beginning of the present message on
        self._place = 0  # bytes up to here have been parsed
        self._ends = 0  # number of `>` in the present message
        self._message: _Message | None = None
        self._ended = False
        self._broken = False
        self.wire = b""
        """The bytes of what `next` returned last; none if the length or the end of the stream broke it."""

    def receive(self, data: bytes) -> None:
        """Bytes from the client."""
        self._data += data

    def end(self) -> None:
        """The client sends no more."""
        self._ended = True

    def next(self) -> Element | Broken | None:
        """The next message; None if it is incomplete, and after the stream has broken."""
        if self._broken:
            return None
        try:
            return self._next()
        except Broken as fault:
            broken = fault
        except expat.ExpatError as fault:
            broken = Broken(f"no XML: {expat.ErrorString(fault.code)}")
        self._broken, self._data = True, b""
        return broken

    def _next(self) -> Element | None:
        if self._message is None:
            self._data = _NOTHING.sub(b"", self._data, 1)
            begin = self._data[: len(_BYTE_ORDER_MARK)]
            if not begin or (_BYTE_ORDER_MARK.startswith(begin) and not self._ended):
                return None
            if not begin.startswith(b"<"):
                self.wire = self._data[:MAX_MESSAGE_BYTES]
                raise Broken("a message begins with <")
            self._message, self._place, self._ends = _Message(), 0, 0
        while True:
            end = self._data.find(b">", self._place) + 1
            if (end or len(self._data)) > MAX_MESSAGE_BYTES:
                self.wire = b""
                raise Broken(f"a message of more than {MAX_MESSAGE_BYTES} bytes")
            if not end:
                if self._ended:
                    self.wire = b""
                    raise Broken("the stream ends within a message")
                return None
            self.wire, piece, self._place = self._data[:end], self._data[self._place : end], end
            if b"\0" in piece:  # UTF-16, which Expat would detect by itself
                raise Broken("expected UTF-8")
            self._ends += 1
            if self._ends > MAX_ENDS:
                raise Broken(f"more than {MAX_ENDS} > in a message")
            element = self._message.feed(piece)
            if element is not None:
                self._data, self._message = self._data[end:], None
                return element


class _Message:
    """The present message, as far as it has been received."""

    def __init__(self) -> None:
        self._parser = parser = expat.ParserCreate("UTF-8")  # whatever a declaration says
        # Expat would otherwise defer a long token that comes in parts until it has twice as much to parse
        if hasattr(parser, "SetReparseDeferralEnabled"):
            parser.SetReparseDeferralEnabled(False)
        self._name, self._values, self._fault = "", dict[str, str](), ""
        self._takes_text = False  # the present value does
        self._open: list[str] = []  # the elements that have not ended
        parser.StartDoctypeDeclHandler = self._doctype
        parser.StartElementHandler = self._starts
        parser.CharacterDataHandler = self._text
        parser.EndElementHandler = lambda _: self._open.pop()

    def feed(self, data: bytes) -> Element | None:
        """Parse bytes that end at a `>`; return the message if it ends there."""
        self._parser.Parse(data, False)
        return Element(self._name, self._values, self._fault) if self._name and not self._open else None

    def _doctype(self, *_: object) -> None:
        raise Broken("expected no DTD")

    def _starts(self, name: str, attributes: dict[str, str]) -> None:
        fault = ""
        if not self._open:
            self._name, self._values = name, attributes
        elif len(self._open) > 1:
            fault = f"an element within {self._open[1]}"
        elif attributes:
            fault = f"an attribute of {name}"
        elif name in self._values:
            fault = f"{name} twice"
        else:
            self._values[name] = ""
        self._takes_text = not fault
        self._fault = self._fault or fault
        self._open.append(name)

    def _text(self, text: str) -> None:
        if len(self._open) == 2 and self._takes_text:
            self._values[self._open[1]] += text
        elif len(self._open) == 1 and text.strip(XML_BLANKS):
            self._fault = self._fault or "text between the values"


REGISTERS = 10
"""Integers, and as many reals: a robot with more axes has no place in a message."""
LARGEST_INTEGER = 2**31 - 1
SMALLEST_INTEGER = -(2**31)
REQUEST, REPLY = "Cmd", "Res"

_PLACES = {f"{kind}{place}": place for kind in "IR" for place in range(REGISTERS)}
_DIGITS = len(str(LARGEST_INTEGER))


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


class Command(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One row of the table."""

    id: int
    summary: str
    requirements: tuple[str, ...]
    inputs: dict[str, str] = {}
    """Meaning and unit of each parameter, by register."""
    outputs: dict[str, str] = {}
    """Meaning and unit of each value of the reply, by register."""
    joints: Literal["", "input", "output"] = ""
    """Tells if the reals from R0 on are joint positions (deg) of the request or of the reply."""
    tag: str = ""


class _Rows(msgspec.Struct):
    command: dict[str, Command]


@cache
def load_krc4_table() -> Mapping[int, Command]:
    """Return the commands of protocol/krc4.toml by their ids."""
    text = data_folder("iiwa_sim.protocol").joinpath("krc4.toml").read_bytes()
    rows = msgspec.toml.decode(text, type=_Rows)
    return {row.id: msgspec.structs.replace(row, tag=tag) for tag, row in rows.command.items()}


def understand(element: Element, root: str = REQUEST) -> Message:
    """The message in an XML element: a request, or a reply if the root is that of one."""
    fault = element.fault
    if not fault and element.name != root:
        fault = f"{_shown(element.name)}: expected {root}"
    integers, reals = [0] * REGISTERS, [0.0] * REGISTERS
    for name, value in element.values.items():
        text = value.strip(XML_BLANKS)
        place = _PLACES.get(name)
        if place is None:
            fault = fault or f"{_shown(name)}: expected I0 to I9 and R0 to R9"
            continue
        try:
            if name[0] == "I":
                integers[place] = _integer(text)
            else:
                reals[place] = parse_decimal(text.encode())
        except NotANumberError as wrong:
            fault = fault or f"{name} = {wrong}"
    return Message(tuple(integers), tuple(reals), fault)


def reply_of(integers: Sequence[int], reals: Sequence[float]) -> Element:
    """The reply with these integers (from I0) and reals (from R0), zeros elsewhere. Raises ValueError for
    a value that is not finite."""
    numbers = map(str, (*integers, *[0] * (REGISTERS - len(integers))))
    decimals = format_decimals((*reals, *[0.0] * (REGISTERS - len(reals)))).decode().split()
    return Element(REPLY, dict(zip(_PLACES, (*numbers, *decimals), strict=True)), "")


def _integer(text: str) -> int:
    digits = text.removeprefix("-") if text.startswith("-") else text.removeprefix("+")
    if digits.isascii() and digits.isdigit() and len(digits) <= _DIGITS:
        value = int(text)
        if SMALLEST_INTEGER <= value <= LARGEST_INTEGER:
            return value
    raise NotANumberError(f"{_shown(text)}: expected an integer from {SMALLEST_INTEGER} to {LARGEST_INTEGER}")


def _shown(text: str) -> str:
    return quoted(text.encode())


NO_MESSAGE = "(no message)"
"""Stands for bytes that are no message and cannot be repeated: too long, or cut short."""

_ROOTS = (REQUEST, REPLY)
_BEGINS = re.compile(rf"(?:{'|'.join(_ROOTS)})(?:\s|\Z)")
_ZEROS = ("0", "0.0")
_REGISTER = re.compile(r"I[2-9]|R[0-9]")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.\-]*")
_VALUE = re.compile(r"[!-\[\]-z|~]*")  # printable ASCII without blanks, backslashes and braces


def is_short(line: str) -> bool:
    """Return True if a line is in the short form."""
    return _BEGINS.match(line) is not None


def written(element: Element, wire: bytes = b"") -> str:
    """The line for a message, short if it can be; else for the bytes that it came as."""
    values = {name: value.strip(XML_BLANKS) for name, value in element.values.items()}
    told_in_full = not element.fault and element.name in _ROOTS
    if told_in_full and all(_NAME.fullmatch(n) and _VALUE.fullmatch(v) for n, v in values.items()):
        told = [f"{n}={v}" for n, v in values.items() if not (v in _ZEROS and _REGISTER.fullmatch(n))]
        return " ".join((element.name, *told))
    return word_for_word(wire)


def word_for_word(wire: bytes) -> str:
    """The verbatim line for bytes; NO_MESSAGE for none."""
    line = readable(wire)
    if not wire:
        return NO_MESSAGE
    return rf"\x{wire[0]:02x}{readable(wire[1:])}" if is_short(line) or line == NO_MESSAGE else line


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
    body = "".join(f"<{name}>{escape(value)}</{name}>" for name, value in element.values.items())
    return f"<{element.name}>{body}</{element.name}>".encode()
