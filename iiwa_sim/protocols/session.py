"""Sessions: bytes of one connection in, replies out; no sockets.

A line session gives one reply for each line, in their order. Telnet's IAC DO TIMING-MARK is answered by IAC
WONT TIMING-MARK in its place among the replies; other telnet commands are ignored.
"""

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.endings import Ending
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.dialogue import Dialogue
from iiwa_sim.protocols.decimals import readable
from iiwa_sim.protocols.faults import CannedReplies
from iiwa_sim.protocols.lines import OVERLONG, TIMING_MARK, WONT_TIMING_MARK, LineSplitter
from iiwa_sim.protocols.table import ERROR, Refusal, Request, Table, with_hint

ASKED_OFTEN = 3
"""Times in a row that a client sends the same line before it counts as one that waits."""
LINES_AT_ONCE = 512
"""Lines answered in one batch, which takes a few milliseconds; then the event loop runs."""
CANNED = "the reply to the next line is canned, nothing is carried out"
"""Event in the dialogue."""


class Pending(Protocol):
    """Something that a reply waits for, such as an asyncio.Future."""

    def done(self) -> bool:
        """Return True if it has happened."""

    def add_done_callback(self, callback: Callable[[Any], object], /) -> None:
        """Register a function to be called when it has happened."""


class Session(Protocol):
    """Takes bytes, split anywhere, and returns replies on request."""

    @property
    def waiting(self) -> object:
        """The commands that wait for their reply, or the next of them; false where none does."""

    @property
    def closing(self) -> bool:
        """True if the session ends: the shell sends the replies there are, then closes."""

    @property
    def pending(self) -> Pending | None:
        """Event for which the next reply waits, or None."""

    @property
    def awaits(self) -> bool:
        """True if the newest move is the client's own, and it waits for its end: it asks again and again."""

    def receive(self, data: bytes) -> None:
        """Take bytes from the client."""

    def end(self) -> None:
        """Notice that the client sends no more."""

    def answer(self, most: int = ...) -> bytes:
        """The replies to some of the waiting commands, at most `most`."""

    def lost(self) -> None:
        """Notice that the connection has gone."""


class ProtocolLog(Protocol):
    """Lines are passed as printable ASCII, with other characters escaped."""

    def wants_commands(self) -> bool:
        """Return True if `command` is wanted; asked once for each batch of lines."""

    def command(self, session: str, line: str, reply: str) -> None:
        """A line was carried out and answered."""

    def refused(self, session: str, line: str, code: int, reason: str) -> None:
        """A line was answered `error` or `unknown command`; codes are results of robot_movement_interface."""

    def ignored(self, session: str, command: str, takes: str, beyond: int) -> None:
        """A session sent `beyond` more values than a command takes, for the first time: they are ignored."""

    def odd(self, session: str, command: str, remark: str) -> None:
        """A command was carried out, but may not be what the client means; told once for each session."""

    def stopped(self, session: str, vanished: bool) -> None:
        """The moving robot stops because its client has vanished, or has said bye."""

    def exception(self, session: str, line: str, fault: Exception) -> None:
        """The controller failed at this line with an internal error; the line was answered `error`."""


class OwnMoves(set[int]):
    """Moves of one connection, by number, that have not ended."""

    def has_ended(self, ending: Ending) -> None:
        """Notice that a move has ended; the controller is given this with each of them."""
        self.discard(ending.move)

    def abandon(self, controller: Controller, log: ProtocolLog, session: str) -> None:
        """Notice that the connection has vanished: stop the robot if one of its moves runs or waits."""
        if self:
            controller.stop()
            log.stopped(session, vanished=True)


class LineSession:
    """One connection whose lines are the commands of a table, for one robot.

    A refused line is answered as the table has it, and the reason told to the log and the robot.
    """

    def __init__(
        self,
        controller: Controller,
        log: ProtocolLog,
        name: str,
        table: Table,
        commands: Mapping[str, Callable[[Any, Request], bytes]],
        dialogue: Dialogue | None = None,
        *,
        strict: bool = False,
        canned: CannedReplies | None = None,
    ) -> None:
        """Create a session.

        Args:
            controller: The robot.
            log: Log of the protocol.
            name: Name of this connection in log and dialogue.
            table: The commands.
            commands: The handler of each row of `table`. It gives the reply with its line end, and may raise
                `Refused`.
            dialogue: Told of each line, if given.
            strict: Refuse values after the last parameter, which are ignored and logged otherwise.
            canned: Replies that are given in place of carrying out a command.
        """
        self.controller = controller
        self.log = log
        self.name = name
        self.table = table
        self.dialogue = dialogue or Dialogue(lambda: 0)  # not heard: no tick is asked for
        self.waiting: deque[bytes] = deque()
        """Lines that wait for an answer."""
        self.closing = False
        """True if the client has said bye: the shell sends the replies there are and closes."""
        self.pending: Pending | None = None
        """Event that the next reply waits for."""
        self.ends_batch = False
        """True if the present batch of replies ends with this line, which takes long."""
        self.awaits = False
        """True if the newest move is the client's own, and it waits for its end: it repeats a line."""
        self._commands = commands
        self._strict = strict
        self._canned = canned or CannedReplies()
        self._splitter = LineSplitter()
        self._line, self._times = b"", 0  # the last one, and how many times in a row it came
        self._command = self._reason = ""  # of the last line, for the dialogue
        self._logs_commands = False
        self._beyond_told: set[str] = set()  # commands that came with values after their last parameter
        self._degrees_told: set[str] = set()  # commands that came with angles that may be in degrees

    def receive(self, data: bytes) -> None:
        """Take bytes from the client."""
        if not self.closing:
            self.waiting.extend(self._splitter.feed(data))

    def end(self) -> None:
        """Notice that the client sends no more; an unfinished last line counts as a line."""
        if not self.closing:
            self.waiting.extend(self._splitter.finish())

    def answer(self, most: int = LINES_AT_ONCE) -> bytes:
        r"""Return the replies to the next waiting lines, each with its `\r\n`.

        At most `most`, and no further than a line that ends the batch; none while one is `pending`. Call
        again while lines are `waiting`.
        """
        if self.pending is not None and not self.pending.done():
            return b""
        lines, dialogue = self.waiting, self.dialogue
        self.ends_batch = False
        self._logs_commands = self.log.wants_commands()  # asked for once, since it is asked for often
        replies: list[bytes] = []
        for _ in range(min(len(lines), most)):
            line = lines.popleft()
            if line is TIMING_MARK:
                replies.append(WONT_TIMING_MARK)
                continue
            self._command = self._reason = ""
            self._line, self._times = line, self._times + 1 if line == self._line else 1
            self.awaits = self._times >= ASKED_OFTEN and self._moved_last()
            reply = self._reply(line)
            replies.append(reply)
            if dialogue.is_heard:
                dialogue.exchange(self.name, shown(line), reply[:-2].decode(), self._reason, self._command)
            if self.ends_batch:
                break
        return b"".join(replies)

    def lost(self) -> None:
        """Notice that the connection has gone: waiting lines are dropped."""
        self.waiting.clear()
        self.closing = True

    def close(self) -> None:
        """End the session after this line; later lines are not answered."""
        self.waiting.clear()
        self.closing = self.ends_batch = True

    def _moved_last(self) -> bool:
        """Return True if the newest move is the client's own, and has not ended."""
        return False

    def _reply(self, line: bytes) -> bytes:
        request = self.table.parse(line)
        if isinstance(request, Refusal):
            return self._refuse(line, request)
        name = self._command = request.command.name
        if request.beyond and not self._ignores_beyond(request):
            return self._refuse(line, request.too_much())
        if self._canned.any and (text := self._canned.take(name)) is not None:
            self.dialogue.event(self.name, CANNED)
            return written(text)
        try:
            reply = self._commands[name](self, request)
        except Refused as refused:
            return self._refuse(line, Refusal(ERROR, refused.code, with_hint(refused.reason, request)))
        except Exception as exception:  # an internal error must not cost the client its connection
            self.log.exception(self.name, shown(line), exception)
            self._reason = f"internal error at '{shown(line)}', see the log"
            self.controller.record_error(EXECUTION, self._reason)
            return written(ERROR)
        if request.in_degrees and name not in self._degrees_told:
            self._degrees_told.add(name)
            self.log.odd(self.name, name, request.in_degrees)
        if self._logs_commands:
            self.log.command(self.name, shown(line), reply[:-2].decode())
        return reply

    def _ignores_beyond(self, request: Request) -> bool:
        """Return True if values after the last parameter are ignored; each command is logged once."""
        name = request.command.name
        if not self._strict and name not in self._beyond_told:
            self._beyond_told.add(name)
            self.log.ignored(self.name, name, request.command.takes(), request.beyond)
        return not self._strict

    def _refuse(self, line: bytes, refusal: Refusal) -> bytes:
        self.log.refused(self.name, shown(line), refusal.code, refusal.reason)
        self._reason = f"{refusal.code} {refusal.reason}"
        self.controller.record_error(refusal.code, refusal.reason)
        return written(refusal.reply)


def written(text: str) -> bytes:
    """A reply with its line end."""
    return text.encode("ascii", "backslashreplace") + b"\r\n"


def shown(line: bytes) -> str:
    """A line as text for log and dialogue."""
    return "(too long)" if line is OVERLONG else readable(line)
