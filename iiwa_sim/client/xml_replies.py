"""Bytes in, KRC4 replies out (values by name), however the bytes are split into packets.

A reply is one XML element with values as child elements or as attributes, and ends where that element does.
Expat is fed up to each `>`, so the end of the element is the end of the fed bytes. Anything but elements with
text is refused as it comes: a DTD before it could declare an entity, and elements within values.
"""

from xml.parsers import expat

ROOT = "Res"

MAX_ENDS = 100
"""Most `>` in a reply, which normally has 42. Each costs a scan of the open elements: without a bound a
reply of 64 KiB could keep a program busy for seconds."""

_BLANKS = b" \t\r\n"


class XmlReplies:
    """The replies of one connection."""

    def __init__(self) -> None:
        self._heard = b""
        self._parsed = 0  # bytes of the present reply
        self._ends = 0  # number of `>` in the present reply
        self._reply = _Reply()

    def feed(self, data: bytes) -> None:
        """Add received bytes."""
        self._heard += data

    @property
    def unread(self) -> bytes:
        """Received bytes that belong to no reply yet, without blanks and line ends between replies."""
        if self._parsed == 0:
            self._heard = self._heard.lstrip(_BLANKS)
        return self._heard

    def take(self) -> dict[str, str] | None:
        """The values of the next reply; None until it is complete.

        Raises ValueError, quoting the bytes, for something that cannot become a reply.
        """
        heard = self.unread
        if heard and (heard[:1] != b"<" or b"\0" in heard):  # Expat would guess UTF-16, and wait for more
            raise ValueError(f"what is no XML in UTF-8: {heard[:40]!r}")
        while self._parsed < len(heard):
            closed = heard.find(b">", self._parsed) + 1
            end = closed or len(heard)
            self._ends += closed > 0
            if self._ends > MAX_ENDS:
                raise ValueError(f"what has more than {MAX_ENDS} > in a reply")
            self._reply.parse(heard[self._parsed : end])
            self._parsed = end
            if self._reply.complete:
                values = self._reply.values
                self._heard, self._parsed, self._ends, self._reply = heard[end:], 0, 0, _Reply()
                return values
        return None


class _Reply:
    """One reply, as far as it has been received."""

    def __init__(self) -> None:
        self._parser = parser = expat.ParserCreate("UTF-8")
        parser.buffer_text = True
        # Expat would otherwise defer a token that comes in parts until it has twice as much to parse
        if hasattr(parser, "SetReparseDeferralEnabled"):
            parser.SetReparseDeferralEnabled(False)
        parser.StartDoctypeDeclHandler = self._doctype
        parser.StartElementHandler = self._starts
        parser.CharacterDataHandler = self._text
        parser.EndElementHandler = self._ends
        self._depth = 0
        self._texts: list[str] = []
        self.values: dict[str, str] = {}
        self.complete = False

    def parse(self, data: bytes) -> None:
        """Parse the next bytes, up to a `>`. Raises ValueError."""
        try:
            self._parser.Parse(data, False)
        except expat.ExpatError as fault:
            raise ValueError(f"what is no XML: {expat.ErrorString(fault.code)}") from None

    def _doctype(self, *_: object) -> None:
        raise ValueError("a DTD")

    def _starts(self, name: str, attributes: dict[str, str]) -> None:
        self._depth += 1
        if self._depth == 1:
            if name != ROOT:
                raise ValueError(f"{name[:40]!r} in place of {ROOT!r}")
            self.values = dict(attributes)
        elif self._depth == 2 and not attributes:
            self._texts = []
        else:
            raise ValueError(f"elements or attributes within the values of {ROOT!r}")

    def _text(self, text: str) -> None:
        if self._depth == 2:
            self._texts.append(text)
        elif text.strip():
            raise ValueError(f"text between the values of {ROOT!r}")

    def _ends(self, name: str) -> None:
        self._depth -= 1
        if self._depth == 0:
            self.complete = True
        elif name in self.values:
            raise ValueError(f"{name[:40]!r} twice")
        else:
            self.values[name] = "".join(self._texts)
