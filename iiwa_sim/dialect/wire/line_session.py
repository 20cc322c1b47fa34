"""What sessions of all line protocols share: bytes in, one reply for each line out, in the lines' order.

Telnet's IAC DO TIMING-MARK is answered by IAC WONT TIMING-MARK in its place among the
replies; all else of telnet is ignored.
"""

from abc import abstractmethod
from collections import deque

from iiwa_sim.dialect.session import Pending
from iiwa_sim.dialect.wire.decimals import readable
from iiwa_sim.dialect.wire.dialogue import Dialogue
from iiwa_sim.dialect.wire.lines import OVERLONG, TIMING_MARK, WONT_TIMING_MARK, LineSplitter
from iiwa_sim.dialect.wire.log import DialectLog

LINES_AT_ONCE = 512
"""Answered in a few milliseconds; then the event loop gets its turn."""


class LineSession:
    """One connection in a line protocol; a subclass says what a line does."""

    def __init__(self, log: DialectLog, name: str, dialogue: Dialogue | None = None) -> None:
        """`name` tells this connection from others in the log, and in the dialogue if it is part of one."""
        self.log = log
        self.name = name
        self._dialogue = dialogue
        self._splitter = LineSplitter()
        self._lines: deque[bytes] = deque()
        self._closing = False
        self._pauses = False

    @property
    def waiting(self) -> bool:
        """Whether lines wait for an answer."""
        return bool(self._lines)

    @property
    def closing(self) -> bool:
        """Whether the client has said bye: the shell sends what is to be sent and closes."""
        return self._closing

    @property
    def pending(self) -> Pending | None:
        """What the next reply waits for."""
        return None

    def receive(self, data: bytes) -> None:
        """Bytes from the client."""
        if not self._closing:
            self._lines.extend(self._splitter.feed(data))

    def end(self) -> None:
        """The client sends no more; what it sent last counts as a line, with or without a line end."""
        if not self._closing:
            self._lines.extend(self._splitter.finish())

    def answer(self, most: int = LINES_AT_ONCE) -> bytes:
        r"""The replies to the next waiting lines, each with its `\r\n`.

        To `most` of them, and only as far as a line at which `pause` or `close` is called: to be called again
        while `waiting`.
        """
        lines, dialogue = self._lines, self._dialogue
        if dialogue is not None and not dialogue.listeners:
            dialogue = None
        self._pauses = False
        replies: list[bytes] = []
        for _ in range(min(len(lines), most)):
            line = lines.popleft()
            if line is TIMING_MARK:
                replies.append(WONT_TIMING_MARK)
                continue
            reply = self._reply(line)
            replies.append(reply)
            if dialogue is not None:
                dialogue.exchange(self.name, shown(line), reply[:-2].decode())
            if self._pauses:
                break
        return b"".join(replies)

    def lost(self) -> None:
        """The connection has gone: what waits is not answered any more."""
        self._lines.clear()
        self._closing = True

    def pause(self) -> None:
        """End the present `answer` with this line, whose work takes long."""
        self._pauses = True

    def close(self) -> None:
        """End the session with this line; those behind it are not answered."""
        self._lines.clear()
        self._closing = self._pauses = True

    @abstractmethod
    def _reply(self, line: bytes) -> bytes:
        """Do what a line asks for, and give the reply with its line end; nothing where it comes later."""


def written(text: str) -> bytes:
    """A reply: text with its line end."""
    return text.encode("ascii", "backslashreplace") + b"\r\n"


def shown(line: bytes) -> str:
    """A line as text for log and dialogue."""
    return "(too long)" if line is OVERLONG else readable(line)
