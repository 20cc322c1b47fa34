r"""Bytes in, lines out: what a line is, whichever way the bytes are cut into packets.

- A line ends with `\n`, `\r`, `\r\n` or `\n\r`. Ends are paired greedily from the left: `\r\n\r\n` are two
  ends, and so are `\n\r\n` (`\n\r`, then `\n`) and `\n\n`. A `\r` at the end of a packet ends its line at
  once; a `\n` that opens the next packet still belongs to it.
- Telnet's commands within a line are dropped: IAC WILL/WONT/DO/DONT x, and any other IAC x. NUL at the
  beginning of a line goes too: telnet sends `\r\0` for a bare return (RFC 854), C programs end strings so.
- IAC DO TIMING-MARK yields TIMING_MARK before its line: telnet sends it at Ctrl-C, and shows nothing more
  until it is answered (RFC 860). It is not recognised if the end of a packet cuts it.
- A line of more than MAX_LINE_BYTES yields OVERLONG as soon as that is seen, and is skipped to its end.

At most MAX_LINE_BYTES and the bytes of one packet are held at any time.
"""

import re

MAX_LINE_BYTES = 4096
OVERLONG = b"\n"  # stands for a line that was too long; no real line can hold a line end
TIMING_MARK = b"\r"  # stands for telnet's timing mark, which is answered by WONT_TIMING_MARK
WONT_TIMING_MARK = b"\xff\xfc\x06"

_END = re.compile(rb"\r\n|\n\r|\r|\n")
_ENDS = (b"\r", b"\n")
_PARTNER = {b"\r": b"\n", b"\n": b"\r"}
_IAC = b"\xff"
_DO_TIMING_MARK = b"\xff\xfd\x06"
_TELNET = re.compile(rb"\xff(?:[\xfb-\xfe].?|.)?", re.DOTALL)


class LineSplitter:
    """Splits the bytes of one connection into lines."""

    def __init__(self) -> None:
        self._rest = b""  # of a line whose end has not come yet
        self._skipping = False  # within a line that was too long
        self._partner = b""  # second half of the last line end, skipped if it opens the next packet

    def feed(self, data: bytes) -> list[bytes]:
        """The lines that `data` completes, without their ends, with a TIMING_MARK for each that came."""
        marks = [TIMING_MARK] * data.count(_DO_TIMING_MARK)
        if data and self._partner:
            data = data.removeprefix(self._partner)
            self._partner = b""
        if not data:
            return marks
        if data.endswith(_ENDS):
            self._partner = _open_partner(data)
        lines = _split(data)
        lines[0] = self._rest + lines[0]
        self._rest = lines.pop()
        if self._skipping:
            if lines:
                del lines[0]
                self._skipping = False
            else:
                self._rest = b""
        if len(data) > MAX_LINE_BYTES or (lines and len(lines[0]) > MAX_LINE_BYTES):
            lines = [line if len(line) <= MAX_LINE_BYTES else OVERLONG for line in lines]
        if len(self._rest) > MAX_LINE_BYTES:
            self._rest = b""
            self._skipping = True
            lines.append(OVERLONG)
        if _IAC in data or b"\0" in data or (lines and (_IAC in lines[0] or b"\0" in lines[0])):
            lines = [_plain(line) for line in lines]
        return marks + lines if marks else lines

    def finish(self) -> list[bytes]:
        """The unfinished last line at the end of the stream."""
        rest, self._rest = _plain(self._rest), b""
        return [rest] if rest else []


def _plain(line: bytes) -> bytes:
    """A line without telnet's commands, and without NUL at its beginning."""
    if _IAC in line:
        line = _TELNET.sub(b"", line)
    return line.lstrip(b"\0") if line.startswith(b"\0") else line


def _split(data: bytes) -> list[bytes]:
    # Splitting at a single byte is several times faster than by the expression, and gives the same result if
    # all line ends are of one kind.
    if b"\r" not in data:
        return data.split(b"\n")
    if b"\n\r" not in data:
        return data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
    return _END.split(data)


def _open_partner(data: bytes) -> bytes:
    """The byte that would complete the line end at the end of `data`; empty if that is a pair already."""
    if data[-2:] == b"\r\n" and data[-3:-2] not in _ENDS:
        return b""
    run = data[len(data.rstrip(b"\r\n")) :]
    return _PARTNER.get(_END.findall(run)[-1], b"")
