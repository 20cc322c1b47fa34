r"""Bytes in, lines out: what a line is, whichever way the bytes are cut into packets.

- A line ends with `\n`, `\r`, `\r\n` or `\n\r`. Ends are paired greedily from the left: `\r\n\r\n` are two
  ends, and so are `\n\r\n` (`\n\r`, then `\n`) and `\n\n`. A `\r` at the end of a packet ends its line at
  once; a `\n` that opens the next packet still belongs to it.
- Telnet's commands are dropped: IAC WILL/WONT/DO/DONT x, IAC SB ... IAC SE, IAC IAC, and any other IAC x.
  Where x is a line end, only the IAC goes, so that a stray 255 costs nobody a reply. NUL at the beginning of
  a line goes too: telnet sends `\r\0` for a bare return (RFC 854), C programs the end of a string.
- But IAC DO TIMING-MARK yields TIMING_MARK where it stands, within a line before that line: a telnet program
  sends it at Ctrl-C, and shows nothing more until it is answered (RFC 860).
- A subnegotiation, IAC SB ... IAC SE, also ends before a line end and after MAX_SUBNEGOTIATION bytes, a pair
  of IAC and another byte counted as one: no option was agreed upon, so what seems to open one is noise, and
  the client that sends it is to be heard again.
- A line of more than MAX_LINE_BYTES yields OVERLONG as soon as that is seen, and is skipped to its end.

At most MAX_LINE_BYTES, one telnet command and the bytes of one packet are held at any time.
"""

import re

MAX_LINE_BYTES = 4096
MAX_SUBNEGOTIATION = 256
OVERLONG = b"\n"  # stands for a line that was too long; no real line can hold a line end
TIMING_MARK = b"\r"  # stands for telnet's timing mark, which is answered by WONT_TIMING_MARK
WONT_TIMING_MARK = b"\xff\xfc\x06"

_END = re.compile(rb"\r\n|\n\r|\r|\n")
_ENDS = (b"\r", b"\n")
_PARTNER = {b"\r": b"\n", b"\n": b"\r"}

_IAC = b"\xff"
_OPTION = rb"(?:[^\xff\r\n]|\xff[^\xf0\r\n])"  # of a subnegotiation
_OPTIONS = _OPTION + rb"{0,%d}+" % (MAX_SUBNEGOTIATION - 1)
_TELNET = re.compile(
    # All of a run at once, as noise may be nothing else: IAC x, IAC WILL/WONT/DO/DONT x, IAC SB ...
    rb"(?:\xff(?:[^\xfa-\xfe\r\n]|(?!\xfd\x06)[\xfb-\xfe][\0-\xff]"
    rb"|\xfa" + _OPTIONS + rb"(?:\xff\xf0|\xff?(?=[\r\n])|" + _OPTION + rb")))++"
    rb"|((?:\xff\xfd\x06)++)"  # IAC DO TIMING-MARK
    rb"|\xff(?=[\r\n])"
    rb"|(\xff(?:[\xfb-\xfe]|\xfa" + _OPTIONS + rb"\xff?)?\Z)"  # cut short by the end of a packet
)


class LineSplitter:
    """Splits the bytes of one connection into lines."""

    def __init__(self) -> None:
        self._rest = b""  # of a line whose end has not come yet
        self._skipping = False  # within a line that was too long
        self._partner = b""  # second half of the last line end, skipped if it opens the next packet
        self._telnet = b""  # a telnet command cut by the end of a packet

    def feed(self, data: bytes) -> list[bytes]:
        """The lines that `data` completes, without their ends, with a TIMING_MARK where one came."""
        if not (_IAC in data or self._telnet):
            return self._feed(data)
        first, *others = self._between_timing_marks(data)
        lines = self._feed(first)
        for text in others:
            lines.append(TIMING_MARK)
            if text:
                lines += self._feed(text)
        return lines

    def _feed(self, data: bytes) -> list[bytes]:
        if not data:
            return []
        if self._partner:
            if data.startswith(self._partner):
                data = data[1:]
            self._partner = b""
            if not data:
                return []
        if data.endswith(_ENDS):
            self._partner = _open_partner(data)
        lines = _split(data)
        if self._rest:
            lines[0] = self._rest + lines[0]
        if b"\0" in data or self._rest.startswith(b"\0"):
            lines = [line.lstrip(b"\0") for line in lines]
        self._rest = lines.pop()
        if self._skipping:
            self._skip(lines)
        if len(data) > MAX_LINE_BYTES or (lines and len(lines[0]) > MAX_LINE_BYTES):
            lines = [line if len(line) <= MAX_LINE_BYTES else OVERLONG for line in lines]
        if len(self._rest) > MAX_LINE_BYTES:
            self._rest = b""
            self._skipping = True
            lines.append(OVERLONG)
        return lines

    def finish(self) -> list[bytes]:
        """The unfinished last line at the end of the stream."""
        rest, self._rest = self._rest, b""
        return [rest] if rest else []

    def _skip(self, lines: list[bytes]) -> None:
        """Skip the rest of a line that was too long and has been reported."""
        if lines:
            del lines[0]
            self._skipping = False
        else:
            self._rest = b""

    def _between_timing_marks(self, data: bytes) -> list[bytes]:
        """The data without telnet's commands, divided at timing marks."""
        first, *others = _TELNET.split(self._telnet + data)
        self._telnet = others[-2] or b"" if others else b""
        stretches = [[first]]
        for mark, text in zip(others[::3], others[2::3], strict=True):
            if mark:
                stretches += [[] for _ in range(len(mark) // len(WONT_TIMING_MARK))]
            stretches[-1].append(text)
        return [b"".join(texts) for texts in stretches]


def _split(data: bytes) -> list[bytes]:
    # Splitting at a single byte is several times faster than by the expression, and gives the same result if
    # all line ends are of one kind.
    if b"\r" not in data:
        return data.split(b"\n")
    if b"\n\r" not in data:
        return data.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
    if b"\r\n" not in data:
        return data.replace(b"\n\r", b"\n").replace(b"\r", b"\n").split(b"\n")
    return _END.split(data)


def _open_partner(data: bytes) -> bytes:
    """The byte that would complete the line end at the end of `data`; empty if that is a pair already."""
    end, before = data[-2:], data[-3:-2]
    if end[:-1] not in _ENDS:
        return _PARTNER[end[-1:]]
    if end == b"\r\n" and before not in _ENDS:
        return b""
    run = data[len(data.rstrip(b"\r\n")) :]
    return _PARTNER.get(_END.findall(run)[-1], b"")
