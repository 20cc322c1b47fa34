"""Rejection of connections that speak HTTP or TLS to a port for commands.

A web browser sends data to any port of this machine and its network when a web page asks it to. The page
chooses the body of an HTTP request, whose lines would be taken for commands, and parts of a TLS greeting.
"""

import re

LONGEST = 2048
"""Bytes held back at most while the first line is not complete."""

_REQUEST = re.compile(rb"[A-Za-z]+ +\S[^\r\n]* HTTP/[0-9]")
_LONG_REQUEST = re.compile(rb"[A-Za-z]+ +(?:/|\*|[A-Za-z]+:)")
_TLS = b"\x16\x03"
_LINE_END = re.compile(rb"[\r\n]")
_UNDECIDED = re.compile(rb"[A-Za-z]+(?: +(?:(?:/|\*|[A-Za-z]+:).*|[A-Za-z]*))?|\x16", re.DOTALL)
"""A prefix that may still become an HTTP request. Only such a prefix is held back, as KRC4 messages have
no line ends."""


class FromBrowserFault(Exception):
    """The connection speaks HTTP or TLS. The message names which, for the log."""


def passed_on(data: bytes, ended: bool) -> bool:
    """Return True if the first bytes of a connection can be passed on, False if more has to come.

    `ended` says that no more comes. Raises FromBrowserFault.
    """
    if data.startswith(_TLS):
        raise FromBrowserFault("a greeting of TLS")
    end = _LINE_END.search(data)
    line = data if end is None else data[: end.start()]
    if _REQUEST.match(line) or (len(line) > LONGEST and _LONG_REQUEST.match(line)):
        raise FromBrowserFault("an HTTP request")
    return ended or end is not None or len(line) > LONGEST or not _UNDECIDED.fullmatch(line)
