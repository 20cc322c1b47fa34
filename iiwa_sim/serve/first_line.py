"""Who connects with what is meant for a web server.

A browser sends what a page of any site tells it to any port of this machine and its network. In an HTTP
request a page chooses the body, whose lines would else be commands; in TLS it chooses parts of the greeting.
"""

import re

LONGEST = 2048
"""Bytes that are kept back until the first line has ended."""

_REQUEST = re.compile(rb"[A-Za-z]+ +\S[^\r\n]* HTTP/[0-9]")
_LONG_REQUEST = re.compile(rb"[A-Za-z]+ +(?:/|\*|[A-Za-z]+:)")
_TLS = b"\x16\x03"
_LINE_END = re.compile(rb"[\r\n]")
_UNDECIDED = re.compile(rb"[A-Za-z]+(?: +(?:(?:/|\*|[A-Za-z]+:).*|[A-Za-z]*))?|\x16", re.DOTALL)
"""What may still become a request: KRC4 messages have no line ends, so nothing else is kept back."""


class FromBrowserFault(Exception):
    """What came is no line of ours. The message says what it is, for the log."""


class FirstLine:
    """Looks at the first line of a connection before anything of it is handed on."""

    def __init__(self) -> None:
        self.passed = False
        """The first line is in order: nothing is looked at any more."""
        self._held = b""

    def take(self, data: bytes) -> bytes:
        """What of the bytes so far can be handed on; the rest follows. Raises FromBrowserFault."""
        data = self._held + data
        if data.startswith(_TLS):
            raise FromBrowserFault("a greeting of TLS")
        end = _LINE_END.search(data)
        line = data if end is None else data[: end.start()]
        if _REQUEST.match(line) or (len(line) > LONGEST and _LONG_REQUEST.match(line)):
            raise FromBrowserFault("an HTTP request")
        if end is None and len(line) <= LONGEST and _UNDECIDED.fullmatch(line):
            self._held = data
            return b""
        self._held = b""
        self.passed = True
        return data

    def rest(self) -> bytes:
        """What has been kept back, when no more comes."""
        held, self._held = self._held, b""
        self.passed = True
        return held
