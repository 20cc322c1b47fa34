r"""The backdoor's line protocol: lines of one connection in, calls on the backdoor, replies out.

Lines and replies are as on the main port, one reply per line in order. What is wrong is answered `error CODE
REASON`; nothing of it shows on the main port. Lines behind an `advance` or `run until stopped` wait for it.
Where there is a token, it is the first line; anything else in its place ends the connection.
"""

import asyncio
from collections import deque
from collections.abc import Callable

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.backdoor.line_calls import BYE, LineCalls
from iiwa_sim.backdoor.token import Token
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, Refused
from iiwa_sim.dialect.wire.lines import OVERLONG, TIMING_MARK, WONT_TIMING_MARK, LineSplitter
from iiwa_sim.dialect.wire.log import DialectLog
from iiwa_sim.dialect.wire.table import ERROR
from iiwa_sim.wording import harmless

_LINES_AT_ONCE = 64
_WELCOME = "done"
_NO_TOKEN = "the first line is not the token"


class BackdoorSession:
    """One connection to the backdoor. It has to be used inside an asyncio loop, in which time passes."""

    def __init__(self, backdoor: Backdoor, log: DialectLog, name: str, token: Token | None = None) -> None:
        """`name` tells this connection from others in the log; without a `token` there is none to be told."""
        self._calls = LineCalls(backdoor, log, name)
        self._log = log
        self._name = name
        self._token = token  # until it has been told
        self._splitter = LineSplitter()
        self._lines: deque[bytes] = deque()
        self._taking_time: tuple[bytes, asyncio.Task[str]] | None = None
        self._closing = False

    @property
    def waiting(self) -> bool:
        """Whether lines wait for an answer."""
        return self._taking_time is not None or bool(self._lines)

    @property
    def pending(self) -> asyncio.Task[str] | None:
        """What the next reply waits for."""
        return None if self._taking_time is None else self._taking_time[1]

    @property
    def closing(self) -> bool:
        """Whether the client has said bye, or something else than the token."""
        return self._closing

    def receive(self, data: bytes) -> None:
        """Bytes from the client."""
        if not self._closing:
            self._lines.extend(self._splitter.feed(data))

    def end(self) -> None:
        """The client sends no more; a rest without a line end is a line."""
        if not self._closing:
            self._lines.extend(self._splitter.finish())

    def answer(self, most: int = _LINES_AT_ONCE) -> bytes:
        r"""The replies to the next waiting lines, each with its `\r\n`, up to one that takes its time."""
        replies: list[bytes] = []
        while len(replies) < most and not self._closing:
            if self._taking_time is not None:
                line, task = self._taking_time
                if not task.done():
                    break
                self._taking_time = None
                replies.append(self._replied(line, task.result))
            elif self._lines:
                line = self._lines.popleft()
                reply = self._reply(line)
                if reply is not None:
                    replies.append(reply)
            else:
                break
        return b"".join(replies)

    def lost(self) -> None:
        """The connection has gone: what it asked for remains, but for time that would still have to pass."""
        self._end_lines()
        if self._taking_time is not None:
            self._taking_time[1].cancel()
            self._taking_time = None

    def _reply(self, line: bytes) -> bytes | None:
        """None if it will be there when a task is done."""
        if line is TIMING_MARK:
            return WONT_TIMING_MARK
        if self._token is not None:
            return self._admitted(self._token, line)
        try:
            with self._calls.telling(line):
                request = self._calls.parse(line)
                if request.command.name == BYE:
                    self._end_lines()
                reply = self._calls.start(request)
        except Refused as refused:
            return _error(refused)
        if isinstance(reply, str):
            self._calls.done(line, reply)
            return _line(reply)
        self._taking_time = line, asyncio.get_running_loop().create_task(reply)
        return None

    def _admitted(self, token: Token, line: bytes) -> bytes:
        if line is not OVERLONG and token.fits(line):
            self._token = None
            return _line(_WELCOME)
        self._end_lines()
        # What was sent may be a token with a slip in it: it is not for the log.
        self._log.refused(self._name, "(not shown)", COMMUNICATION_FAILURE, _NO_TOKEN)
        return _error(Refused(COMMUNICATION_FAILURE, _NO_TOKEN))

    def _end_lines(self) -> None:
        self._lines.clear()
        self._closing = True

    def _replied(self, line: bytes, answer: Callable[[], str]) -> bytes:
        try:
            with self._calls.telling(line):
                reply = answer()
        except Refused as refused:
            return _error(refused)
        self._calls.done(line, reply)
        return _line(reply)


def _error(refused: Refused) -> bytes:
    return _line(f"{ERROR} {refused.code} {harmless(refused.reason)}")


def _line(text: str) -> bytes:
    return text.encode("ascii", "backslashreplace") + b"\r\n"
