"""The base of sessions in line protocols: one reply for each line, in the order of the lines.

Telnet's IAC DO TIMING-MARK is answered by IAC WONT TIMING-MARK in its place among the replies; other telnet
commands are ignored.
"""

from abc import abstractmethod
from collections import deque

from iiwa_sim.dialect.session import Pending
from iiwa_sim.dialect.wire.decimals import readable
from iiwa_sim.dialect.wire.dialogue import Dialogue
from iiwa_sim.dialect.wire.lines import OVERLONG, TIMING_MARK, WONT_TIMING_MARK, LineSplitter
from iiwa_sim.dialect.wire.log import DialectLog

LINES_AT_ONCE = 512
"""Lines answered in one batch, which takes a few milliseconds; then the event loop runs."""


class LineSession:
    """One connection in a line protocol; a subclass defines what a line does."""

    def __init__(self, log: DialectLog, name: str, dialogue: Dialogue | None = None) -> None:
        """`name` identifies this connection in the log, and in `dialogue` if it is given."""
        self.log = log
        self.name = name
        self._dialogue = dialogue
        self._splitter = LineSplitter()
        self._lines: deque[bytes] = deque()
        self.closing = False
        """Whether the client has said bye: the shell sends what is to be sent and closes."""
        self.pending: Pending | None = None
        """What the next reply waits for."""
        self._pauses = False
        self._logs_commands = False
        self.reason = ""
        """Why the last line was refused, for the dialogue; empty where it was not."""

    @property
    def waiting(self) -> bool:
        """Whether lines wait for an answer."""
        return bool(self._lines)

    def receive(self, data: bytes) -> None:
        """Bytes from the client."""
        if not self.closing:
            self._lines.extend(self._splitter.feed(data))

    def end(self) -> None:
        """Notice that the client sends no more; an unfinished last line counts as a line."""
        if not self.closing:
            self._lines.extend(self._splitter.finish())

    def answer(self, most: int = LINES_AT_ONCE) -> bytes:
        r"""The replies to the next waiting lines, each with its `\r\n`.

        At most `most`, and no further than a line at which `pause` or `close` is called; call again while
        `waiting`.
        """
        lines, dialogue = self._lines, self._dialogue
        if dialogue is not None and not dialogue.listeners:
            dialogue = None
        self._pauses = False
        self._logs_commands = self.log.commands  # asked for once, since it is asked for often
        replies: list[bytes] = []
        for _ in range(min(len(lines), most)):
            line = lines.popleft()
            if line is TIMING_MARK:
                replies.append(WONT_TIMING_MARK)
                continue
            self.reason = ""
            reply = self._reply(line)
            replies.append(reply)
            if dialogue is not None:
                dialogue.exchange(self.name, shown(line), reply[:-2].decode(), self.reason)
            if self._pauses:
                break
        return b"".join(replies)

    def lost(self) -> None:
        """Notice that the connection has gone: waiting lines are dropped."""
        self._lines.clear()
        self.closing = True

    def pause(self) -> None:
        """End the present batch of replies after this line, which took long."""
        self._pauses = True

    def close(self) -> None:
        """End the session after this line; later lines are not answered."""
        self._lines.clear()
        self.closing = self._pauses = True

    @abstractmethod
    def _reply(self, line: bytes) -> bytes:
        """Carry out a line; returns its reply with line end, or nothing if the reply comes later."""


def written(text: str) -> bytes:
    """A reply with its line end."""
    return text.encode("ascii", "backslashreplace") + b"\r\n"


def shown(line: bytes) -> str:
    """A line as text for log and dialogue."""
    return "(too long)" if line is OVERLONG else readable(line)
