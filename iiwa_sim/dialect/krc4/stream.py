"""Bytes in, XML messages out, whichever way the bytes are cut into packets.

Messages follow each other without prefix or separator: one ends where its root element does, and blanks,
line ends and byte order marks between two are nothing. Expat is fed up to each `>`, so a root's end is the
end of what was fed. It is not asked to do more than elements: a DTD, and with it every entity of one's own,
is turned down before it means anything.

What is no XML leaves no way to tell where the next message would begin; so the stream is broken from there
on. A message that is XML, but has what no message has, carries a fault instead.
"""

import re
from typing import NamedTuple
from xml.parsers import expat

MAX_MESSAGE_BYTES = 16384
"""EKI's receive buffer: a longer message breaks the stream."""
MAX_DEPTH = 8
"""Elements within each other, beyond which the stream is broken. A message has two."""

MAX_ENDS = 100
"""How often `>` may be in a message, beyond which the stream is broken; with all twenty values it has 42.
Each costs a look at what is open there, so that without a bound 16 KiB would keep the robot waiting 0.2 s."""

XML_BLANKS = " \t\r\n"
"""What XML takes for a blank: no-break spaces and their kin are text."""

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # as .NET writes it before UTF-8
_NOTHING = re.compile(rb"(?:[ \t\r\n]+|%b)*" % _BYTE_ORDER_MARK)
_ENCODINGS = ("utf-8", "us-ascii")


class Element(NamedTuple):
    """One message: the root's name, and its values by their name, be they attributes or elements."""

    name: str
    values: dict[str, str]
    fault: str
    """What no message has, if this one has it."""


class Broken(NamedTuple):
    """There is no reading on."""

    reason: str


class XmlStream:
    """One connection's way from bytes to messages."""

    def __init__(self) -> None:
        self._data = b""
        self._place = 0  # up to here it has been parsed
        self._size = 0  # of the message, so far
        self._ends = 0  # `>` in the message, so far
        self._message: _Message | None = None
        self._pieces: list[bytes] = []  # of the message, so far
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
        """The bytes of what `next` gave last.

        Of what broke the stream, as many as break another one; none where that was its length or its end.
        """
        return b"".join(self._pieces)

    @property
    def unread(self) -> bytes:
        """What has come and is in no message yet, but for blanks before one."""
        if self._message is not None:
            return self.wire + self._data[self._place :]
        return self._data[self._behind_blanks() :]

    def next(self) -> Element | Broken | None:
        """The next message; None where it is not complete yet, and after the stream has broken."""
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
            if b"\0" in piece:  # UTF-16, which Expat would guess
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
    """The message says why."""


class _Message:
    """One message as far as it has come."""

    def __init__(self) -> None:
        self._parser = parser = expat.ParserCreate("UTF-8")
        parser.buffer_text = True
        # Expat would else put off a long token that comes in parts, until it has twice as much to read.
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
