r"""The backdoor's line protocol: lines of one connection in, calls on the backdoor, replies out.

Lines and replies are as on the main port, one reply per line in order. What is wrong is answered `error CODE
REASON`; nothing of it shows on the main port. Lines behind an `advance` or `run until stopped` wait for it.
"""

import asyncio
from collections import deque
from collections.abc import Callable

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.backdoor.calls import CALLS, TAKES_TIME
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, EXECUTION, Refused
from iiwa_sim.dialect.wire.decimals import readable
from iiwa_sim.dialect.wire.help import alike, overview, usage
from iiwa_sim.dialect.wire.lines import OVERLONG, TIMING_MARK, WONT_TIMING_MARK, LineSplitter
from iiwa_sim.dialect.wire.log import DialectLog
from iiwa_sim.dialect.wire.table import ERROR, Refusal, load_table
from iiwa_sim.wording import harmless

_LINES_AT_ONCE = 64
_EXAMPLE = "push"


class BackdoorSession:
    """One connection to the backdoor. It has to be used inside an asyncio loop, in which time passes."""

    def __init__(self, backdoor: Backdoor, log: DialectLog, name: str) -> None:
        """`name` tells this connection from others in the log."""
        self._backdoor = backdoor
        self._log = log
        self._name = name
        self._table = load_table("backdoor", backdoor.joint_count)
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
        """Whether the client has said bye."""
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
        self._lines.clear()
        self._closing = True
        if self._taking_time is not None:
            self._taking_time[1].cancel()
            self._taking_time = None

    def _reply(self, line: bytes) -> bytes | None:
        """None if it will be there when a task is done."""
        if line is TIMING_MARK:
            return WONT_TIMING_MARK
        request = self._table.parse(line)
        if isinstance(request, Refusal):
            return self._error(line, request.code, request.reason)
        name = request.command.name
        if request.beyond:
            count = len(request.values) + request.beyond
            reason = f"{name} takes {request.command.takes()}, got {count}"
            return self._error(line, COMMUNICATION_FAILURE, reason)
        takes_time = TAKES_TIME.get(name)
        if takes_time is not None:
            coroutine = takes_time(self._backdoor, request)
            self._taking_time = line, asyncio.get_running_loop().create_task(coroutine)
            return None
        if name == "bye":
            self._lines.clear()
            self._closing = True
            return self._replied(line, lambda: "bye")
        if name == "help":
            return self._replied(line, lambda: self._help(request.phrase.lower()))
        return self._replied(line, lambda: CALLS[name](self._backdoor, request))

    def _replied(self, line: bytes, answer: Callable[[], str]) -> bytes:
        log = self._log
        try:
            reply = answer()
        except Refused as refused:
            return self._error(line, refused.code, refused.reason)
        except Exception as fault:  # a fault of ours must not cost the client its connection
            log.exception(self._name, _text(line), fault)
            return _line(f"{ERROR} {EXECUTION} internal fault, told in the log")
        if log.commands:
            log.command(self._name, _text(line), reply)
        return _line(reply)

    def _error(self, line: bytes, code: int, reason: str) -> bytes:
        self._log.refused(self._name, _text(line), code, reason)
        return _line(f"{ERROR} {code} {harmless(reason)}")

    def _help(self, phrase: str) -> str:
        if not phrase:
            return overview(self._table, _EXAMPLE)
        command = self._table.commands.get(phrase)
        if command is None:
            names = alike(self._table, phrase)
            if not names:
                raise Refused(COMMUNICATION_FAILURE, "no such command")
            return f"alike: {names}"
        return usage(command)


def _line(text: str) -> bytes:
    return text.encode("ascii", "backslashreplace") + b"\r\n"


def _text(line: bytes) -> str:
    return "(too long)" if line is OVERLONG else readable(line)
