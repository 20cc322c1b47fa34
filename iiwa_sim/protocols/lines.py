r"""Bytes in, lines out, however the bytes are cut into packets.

- A line ends with `\n`, `\r`, `\r\n` or `\n\r`. Ends are paired greedily from the left: `\r\n\r\n` are two
  ends, and so are `\n\r\n` (`\n\r`, then `\n`) and `\n\n`. A `\r` at the end of a packet ends its line at
  once; a `\n` that opens the next packet still belongs to it.
- Telnet's commands within a line are dropped: IAC WILL/WONT/DO/DONT x, and any other IAC x. NUL at the
  beginning of a line goes too: telnet sends `\r\0` for a bare return (RFC 854), C programs end strings so.
- A line of more than MAX_LINE_BYTES yields OVERLONG as soon as that is seen, and is skipped to its end.

At most MAX_LINE_BYTES and the bytes of one packet are held at any time.
"""

import re

MAX_LINE_BYTES = 4096
OVERLONG = b"\n"  # stands for a line that was too long; no real line can hold a line end

_END = re.compile(rb"(\r\n|\n\r|\r|\n)")
_PARTNER = {b"\r": b"\n", b"\n": b"\r"}
_IAC = b"\xff"
_TELNET = re.compile(rb"\xff(?:[\xfb-\xfe].?|.)?", re.DOTALL)


class LineSplitter:
    """Splitter of the bytes of one connection into lines."""

    def __init__(self) -> None:
        self._rest = b""  # of a line whose end has not come yet
        self._skipping = False  # within a line that was too long
        self._partner = b""  # second half of the last line end, skipped if it opens the next packet

    def feed(self, data: bytes) -> list[bytes]:
        """Return the lines that `data` completes, without their ends."""
        if data:
            data, self._partner = data.removeprefix(self._partner), b""
        *pieces, self._rest = _END.split(self._rest + data)  # lines and ends in turn
        if pieces and not self._rest:
            self._partner = _PARTNER.get(pieces[-1], b"")
        lines = pieces[::2]
        if self._skipping and lines:
            del lines[0]
            self._skipping = False
        elif self._skipping:
            self._rest = b""
        lines = [_plain(line) for line in lines]
        if len(self._rest) > MAX_LINE_BYTES:
            self._rest = b""
            self._skipping = True
            lines.append(OVERLONG)
        return lines

    def finish(self) -> list[bytes]:
        """Return the unfinished last line at the end of the stream."""
        return self.feed(b"\n") if _plain(self._rest) else []


def _plain(line: bytes) -> bytes:
    """Return a line without telnet's commands and leading NUL; OVERLONG for one too long."""
    if len(line) > MAX_LINE_BYTES:
        return OVERLONG
    return (_TELNET.sub(b"", line) if _IAC in line else line).lstrip(b"\0")
