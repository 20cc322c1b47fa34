"""Sessions: bytes of one connection in, replies out; no sockets.

A line session gives one reply for each line, in their order.
"""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.dialogue import Dialogue
from iiwa_sim.log import SessionLog
from iiwa_sim.protocols.decimals import readable
from iiwa_sim.protocols.faults import CannedReplies
from iiwa_sim.protocols.lines import OVERLONG, LineSplitter
from iiwa_sim.protocols.ports import IIWA
from iiwa_sim.protocols.table import Refusal, Request, load_table

DO_TIMING_MARK, WONT_TIMING_MARK = b"\xff\xfd\x06", b"\xff\xfc\x06"
"""Telnet asks at Ctrl-C, and shows nothing more until it is answered (RFC 860)."""
ASKED_OFTEN = 3
"""Times in a row that a client sends the same line before it counts as one that waits."""
AT_ONCE = 512
"""Lines answered in one batch, which takes a few milliseconds; then the event loop runs."""


class Session(ABC):
    """One connection to the robot: takes bytes, split anywhere, and returns replies on request."""

    waiting: Any
    """The commands that wait for their reply, or the next of them; false if none does."""

    def __init__(
        self, controller: Controller, log: SessionLog, name: str, dialogue: Dialogue | None, protocol: str
    ) -> None:
        """`name` identifies this connection in the log, and in `dialogue`, which gets every line."""
        self.controller = controller
        self.log = log
        self.name = name
        self.dialogue = dialogue or Dialogue(lambda: controller.tick)
        self.closing = False
        """True if the session ends: the server sends the replies there are, then closes."""
        self.awaits = False
        """True if the newest move is the client's own, and it waits for its end: it repeats a line."""
        self.ends_batch = False
        """True if the present batch of replies ends with this command, which takes long."""
        self._moves: set[int] = set()  # that have not ended
        self.dialogue.event(name, "connected", protocol)

    @abstractmethod
    def receive(self, data: bytes) -> None:
        """Take bytes from the client."""

    @abstractmethod
    def end(self) -> None:
        """Notice that the client sends no more."""

    def answer(self, most: int = AT_ONCE) -> bytes:
        """Return the replies to the next waiting commands, at most `most`.

        A move ends the batch, even if it is rejected: plans do not delay ticks. Call again while commands
        are `waiting`.
        """
        self.ends_batch, replies = False, list[bytes]()
        while self.waiting and len(replies) < most and not self.ends_batch:
            replies.append(self._answer())
        return b"".join(replies)

    @abstractmethod
    def _answer(self) -> bytes:
        """Return the reply to the next command."""

    def move(self, request: MoveRequest) -> None:
        """Make a move of this connection. Raises `Refused`."""
        self.ends_batch = True
        self._moves.add(self.controller.move(request, lambda ending: self._moves.discard(ending.move)))

    def lost(self) -> None:
        """Notice that the connection has gone: stop the robot if a move of this session is pending."""
        self.close()
        self.dialogue.event(self.name, "disconnected")
        if self._moves:
            self.controller.stop()
            self.log.stopped(self.name, vanished=True)

    def close(self) -> None:
        """End the session after this command; later ones are not answered."""
        self.closing = self.ends_batch = True
        self.waiting = ()


class LineSession(Session):
    """One connection whose lines are the commands of a table, for one robot.

    A refused line is answered as the table has it. The log and the robot get the reason.
    """

    def __init__(
        self,
        controller: Controller,
        log: SessionLog,
        name: str,
        commands: Mapping[str, Callable[[Any, Request], bytes]],
        dialogue: Dialogue | None = None,
        strict: bool = False,
        canned: CannedReplies | None = None,
    ) -> None:
        """`name` stands for the connection in log and dialogue; `commands` has a handler for each.

        A handler gives the reply with its line end, and may raise `Refused`. A `strict` session refuses
        values after the last parameter, which are ignored and logged otherwise. `canned` replies are given
        in place of carrying out a command.
        """
        super().__init__(controller, log, name, dialogue, IIWA)
        self.table = load_table(IIWA)
        self.waiting = deque[bytes]()
        self._commands = commands
        self._strict = strict
        self._canned = canned or CannedReplies()
        self._splitter = LineSplitter()
        self._line, self._times = b"", 0  # the last one, and how many times in a row it came
        self._command = self._reason = ""  # of the last line, for the dialogue
        self._remarked: set[str] = set()  # the commands with a remark in the log

    def receive(self, data: bytes) -> None:
        if not self.closing:
            self.waiting.extend([DO_TIMING_MARK] * data.count(DO_TIMING_MARK))
            self.waiting.extend(self._splitter.feed(data))

    def end(self) -> None:
        """Notice that the client sends no more; an unfinished last line counts as a line."""
        if not self.closing:
            self.waiting.extend(self._splitter.finish())

    def _answer(self) -> bytes:
        line = self.waiting.popleft()
        if line == DO_TIMING_MARK:
            return WONT_TIMING_MARK
        self._command = self._reason = ""
        self._line, self._times = line, self._times + 1 if line == self._line else 1
        self.awaits = self._times >= ASKED_OFTEN and self.controller.accepted in self._moves
        reply = self._reply(line)
        if self.dialogue.is_active:
            self.dialogue.exchange(self.name, shown(line), readable(reply[:-2]), self._reason, self._command)
        return reply

    def _reply(self, line: bytes) -> bytes:
        request = self.table.parse(line)
        if isinstance(request, Refusal):
            return self._refuse(line, request)
        name = self._command = request.command.name
        if request.beyond and self._strict:
            count = len(request.values) + request.beyond
            return self._refuse(line, Refusal(f"{name} takes {request.command.takes()}, got {count}"))
        if self._canned.replies and (text := self._canned.take(name)) is not None:
            self.dialogue.event(self.name, "the reply to the next line is canned, nothing is carried out")
            return written(text)
        try:
            reply = self._commands[name](self, request)
        except Exception as fault:  # an internal error must not cost the client its connection
            if not isinstance(fault, Refused):
                self.log.exception(self.name, shown(line), fault)
                fault = Refused(EXECUTION, f"internal error at '{shown(line)}', see the log")
            return self._refuse(line, Refusal(request.with_hint(fault.reason), code=fault.code))
        if (request.beyond or request.in_degrees) and name not in self._remarked:
            self._remarked.add(name)
            ignored = f"ignores {request.beyond} more than {request.command.takes()}"
            self.log.odd(self.name, name, request.in_degrees or ignored)
        return reply

    def _refuse(self, line: bytes, refusal: Refusal) -> bytes:
        self.log.refused(self.name, shown(line), refusal.code, refusal.reason)
        self._reason = f"{refusal.code} {refusal.reason}"
        self.controller.errors.record(refusal.code, refusal.reason)
        return written(refusal.reply)


def written(text: str) -> bytes:
    """Return a reply with its line end."""
    return text.encode("ascii", "backslashreplace") + b"\r\n"


def shown(line: bytes) -> str:
    """Return a line as text for log and dialogue."""
    return "(too long)" if line is OVERLONG else readable(line)
