"""Bytes in, XML messages out, however the bytes are split into packets.

Messages follow each other without prefix or separator: a message ends where its root element does; blanks,
line ends and byte order marks between messages are skipped. Expat is fed up to each `>`, so the end of the
root is the end of the fed bytes. A DTD, and with it every custom entity, is refused before it takes effect.

Bytes that are no XML give no way to find the next message, so the stream is broken from there on. A message
that is valid XML but has unexpected content carries a fault instead.
"""

import re
from typing import NamedTuple
from xml.parsers import expat

MAX_MESSAGE_BYTES = 16384
"""EKI's receive buffer: a longer message breaks the stream."""
MAX_DEPTH = 8
"""Deepest nesting of elements; a deeper message breaks the stream. A valid message has two levels."""

MAX_ENDS = 100
"""Most `>` in a message; one with more breaks the stream. A message with all twenty values has 42. Each
`>` costs a scan of the open elements: without a bound 16 KiB would delay the robot by 0.2 s."""

XML_BLANKS = " \t\r\n"
"""Characters that XML takes for blanks; no-break spaces and the like are text."""

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # as .NET writes it before UTF-8
_NOTHING = re.compile(rb"(?:[ \t\r\n]+|%b)*" % _BYTE_ORDER_MARK)
_ENCODINGS = ("utf-8", "us-ascii")


class Element(NamedTuple):
    """One message: the name of its root, and its values by name, whether attributes or elements."""

    name: str
    values: dict[str, str]
    fault: str
    """Description of content that no message has; empty if there is none."""


class Broken(NamedTuple):
    """The stream has ended or is broken: nothing more can be read."""

    reason: str


class XmlStream:
    """Splits the bytes of one connection into messages."""

    def __init__(self) -> None:
        self._data = b""
        self._place = 0  # bytes up to here have been parsed
        self._size = 0  # bytes of the present message
        self._ends = 0  # number of `>` in the present message
        self._message: _Message | None = None
        self._pieces: list[bytes] = []  # open elements of the present message
        self._ended = False
        self._broken = False

    def receive(self, data: bytes) -> None:
        """Bytes from the client."""
        self._data = self._data[self._place :] + data
        self._place = 0

    def end(self) -> None:
        """The client sends no more."""
        self._ended = True

    @property
    def wire(self) -> bytes:
        """The bytes of what `next` returned last.

        For what broke the stream, enough bytes to break another one; none if its length or its end broke it.
        """
        return b"".join(self._pieces)

    @property
    def unread(self) -> bytes:
        """Bytes that belong to no message yet, without leading blanks."""
        if self._message is not None:
            return self.wire + self._data[self._place :]
        return self._data[self._behind_blanks() :]

    def next(self) -> Element | Broken | None:
        """The next message; None if it is incomplete, and after the stream has broken."""
        if self._broken:
            return None
        try:
            return self._next()
        except _BrokenStream as broken:
            return self._break(str(broken))
        except expat.ExpatError as fault:
            return self._break(f"no XML: {expat.ErrorString(fault.code)}")

    def _next(self) -> Element | None:
        while True:
            if self._message is None:
                self._place = self._behind_blanks()
                begin = self._data[self._place : self._place + len(_BYTE_ORDER_MARK)]
                if not begin or (_BYTE_ORDER_MARK.startswith(begin) and not self._ended):
                    return None
                self._pieces = []
                if not begin.startswith(b"<"):
                    self._pieces.append(self._data[self._place :][:MAX_MESSAGE_BYTES])
                    raise _BrokenStream("a message begins with <")
                self._message, self._size, self._ends = _Message(), 0, 0
            end = self._data.find(b">", self._place) + 1
            size = self._size + (end or len(self._data)) - self._place
            if size > MAX_MESSAGE_BYTES:
                self._pieces = []
                raise _BrokenStream(f"a message of more than {MAX_MESSAGE_BYTES} bytes")
            if not end:
                if self._ended:
                    self._pieces = []
                    raise _BrokenStream("the stream ends within a message")
                return None
            piece = self._data[self._place : end]
            self._pieces.append(piece)
            if b"\0" in piece:  # UTF-16, which Expat would detect by itself
                raise _BrokenStream("expected UTF-8")
            self._ends += 1
            if self._ends > MAX_ENDS:
                raise _BrokenStream(f"more than {MAX_ENDS} > in a message")
            self._message.feed(piece)
            self._place, self._size = end, size
            if self._message.complete:
                element, self._message = self._message.element(), None
                return element

    def _behind_blanks(self) -> int:
        found = _NOTHING.match(self._data, self._place)
        assert found is not None  # it matches nothing, too
        return found.end()

    def _break(self, reason: str) -> Broken:
        self._broken = True
        self._data, self._place, self._message = b"", 0, None
        return Broken(reason)


class _BrokenStream(Exception):
    """The stream is broken. The message tells why."""


class _Message:
    """One message, as far as it has been received."""

    def __init__(self) -> None:
        self._parser = parser = expat.ParserCreate("UTF-8")
        parser.buffer_text = True
        # Expat would otherwise defer a long token that comes in parts until it has twice as much to parse
        if hasattr(parser, "SetReparseDeferralEnabled"):
            parser.SetReparseDeferralEnabled(False)
        parser.XmlDeclHandler = self._declared
        parser.StartDoctypeDeclHandler = self._doctype
        parser.StartElementHandler = self._starts
        parser.CharacterDataHandler = self._text
        parser.EndElementHandler = self._ends
        self._depth = 0
        self._name = ""
        self._values: dict[str, str] = {}
        self._child = ""
        self._texts: list[str] = []
        self._fault = ""
        self.complete = False

    def feed(self, data: bytes) -> None:
        """Bytes that end at a `>`."""
        self._parser.Parse(data, False)

    def element(self) -> Element:
        return Element(self._name, self._values, self._fault)

    def _declared(self, _version: str, encoding: str | None, _standalone: int) -> None:
        if encoding is not None and encoding.lower() not in _ENCODINGS:
            raise _BrokenStream("expected UTF-8")

    def _doctype(self, *_: object) -> None:
        raise _BrokenStream("expected no DTD")

    def _starts(self, name: str, attributes: dict[str, str]) -> None:
        self._depth += 1
        if self._depth == 1:
            self._name = name
            self._values = dict(attributes)
            return
        if self._depth > MAX_DEPTH:
            raise _BrokenStream(f"more than {MAX_DEPTH} elements within each other")
        if self._depth > 2:
            self._spoil(f"an element within {self._child}")
        elif attributes:
            self._spoil(f"an attribute of {name}")
        self._child, self._texts = name, []

    def _text(self, text: str) -> None:
        if self._depth == 2:
            self._texts.append(text)
        elif text.strip(XML_BLANKS):
            self._spoil("text between the values")

    def _ends(self, name: str) -> None:
        self._depth -= 1
        if self._depth == 0:
            self.complete = True
        elif self._depth == 1:
            if name in self._values:
                self._spoil(f"{name} twice")
            else:
                self._values[name] = "".join(self._texts)

    def _spoil(self, fault: str) -> None:
        self._fault = self._fault or fault
