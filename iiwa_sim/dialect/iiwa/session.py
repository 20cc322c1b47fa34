r"""The iiwa's line protocol: bytes of one connection in, calls on the controller, replies out.

Each line is answered by one line that ends with `\r\n`, in the order in which they came. The session knows no
sockets: a shell hands it bytes and asks for answers while there are lines waiting.
"""

from collections.abc import Sequence

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.endings import Ending
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.dialect.iiwa.commands import COMMANDS
from iiwa_sim.dialect.ports import IIWA
from iiwa_sim.dialect.wire.canned import CannedReplies
from iiwa_sim.dialect.wire.decimals import format_decimals
from iiwa_sim.dialect.wire.dialogue import Dialogue
from iiwa_sim.dialect.wire.line_session import LineSession, shown, written
from iiwa_sim.dialect.wire.log import DialectLog
from iiwa_sim.dialect.wire.table import ERROR, Refusal, Request, in_degrees, with_hint
from iiwa_sim.dialect.wire.table_file import load_table

CANNED = "the reply to the next line is canned, nothing is carried out"
"""What the dialogue is told."""


class IiwaSession(LineSession):
    """One connection to the robot.

    A move, or a check whether one is possible, ends a batch of replies: plans in numbers do not delay ticks.
    """

    def __init__(
        self,
        controller: Controller,
        log: DialectLog,
        name: str,
        dialogue: Dialogue | None = None,
        strict: bool = False,
        canned: CannedReplies | None = None,
    ) -> None:
        """`name` identifies this connection in the log and in `dialogue`, which is told every line if it is
        given.

        Values after the last parameter of a command are ignored, as by the original controller, and logged
        once for each command; with `strict` they are refused. Angles of more than a turn are logged once for
        each command, too. Lines with a `canned` reply get that reply and are not carried out.
        """
        dialogue = dialogue or Dialogue(lambda: controller.tick)
        super().__init__(log, name, dialogue)
        self.table = load_table("iiwa")
        self.controller = controller
        self._moves: set[int] = set()  # of this connection, that have not ended
        self._strict = strict
        self._canned = canned or CannedReplies()
        self._beyond_told: set[str] = set()  # commands that came with values after their last parameter
        self._degrees_told: set[str] = set()  # commands that came with angles that may be in degrees
        self._written: dict[str, tuple[tuple[float, ...], bytes]] = {}
        dialogue.event(name, "connected", IIWA)

    def lost(self) -> None:
        """Notice that the connection has gone: stop the robot if a move of this session is pending."""
        super().lost()
        assert self._dialogue is not None
        self._dialogue.event(self.name, "disconnected")
        if self._moves:
            self.controller.stop()
            self.log.stopped(self.name, vanished=True)
        self._moves.clear()

    def move(self, request: MoveRequest) -> None:
        """Take a move of this connection. Raises `Refused`."""
        self._moves.add(self.controller.move(request, self._has_ended))

    def said_bye(self) -> None:
        """Notice that the client has said bye: stop the robot."""
        self.close()
        if self.controller.moving:
            self.log.stopped(self.name, vanished=False)
        self.controller.stop()

    def numbers(self, command: str, values: Sequence[float]) -> bytes:
        """The reply to a command that asks for numbers.

        Within a tick, and while the robot rests, the numbers repeat: their text is cached.
        """
        last = self._written.get(command)
        if last is not None and last[0] == values:
            return last[1]
        reply = format_decimals(values) + b"\r\n"
        self._written[command] = (tuple(values), reply)
        return reply

    def _has_ended(self, ending: Ending) -> None:
        self._moves.discard(ending.move)

    def _reply(self, line: bytes) -> bytes:
        request = self.table.parse(line)
        if isinstance(request, Refusal):
            return self._refuse(line, request)
        if request.beyond and not self._ignores_beyond(request):
            return self._refuse(line, request.too_much())
        if self._canned.any and (text := self._canned.take(request.command.name)) is not None:
            assert self._dialogue is not None
            self._dialogue.event(self.name, CANNED)
            return written(text)
        try:
            reply = COMMANDS[request.command.name](self, request)
        except Refused as refused:
            return self._refuse(line, Refusal(ERROR, refused.code, with_hint(refused.reason, request)))
        except Exception as exception:  # an internal error must not cost the client its connection
            self.log.exception(self.name, shown(line), exception)
            self.reason = f"internal fault at '{shown(line)}', told in the log"
            self.controller.record_error(EXECUTION, self.reason)
            return written(ERROR)
        if request.values and (hint := in_degrees(request)):
            self._remark(request.command.name, hint)
        if self._logs_commands:
            self.log.command(self.name, shown(line), reply[:-2].decode())
        return reply

    def _ignores_beyond(self, request: Request) -> bool:
        """Whether values after the last parameter are ignored; they are logged once for each command."""
        name = request.command.name
        if not self._strict and name not in self._beyond_told:
            self._beyond_told.add(name)
            self.log.ignored(self.name, name, request.command.takes(), request.beyond)
        return not self._strict

    def _remark(self, command: str, remark: str) -> None:
        """Angles that are carried out in rad may have been meant in degrees: told once for each command."""
        if command not in self._degrees_told:
            self._degrees_told.add(command)
            self.log.odd(self.name, command, remark)

    def _refuse(self, line: bytes, refusal: Refusal) -> bytes:
        self.log.refused(self.name, shown(line), refusal.code, refusal.reason)
        self.reason = f"{refusal.code} {refusal.reason}"
        self.controller.record_error(refusal.code, refusal.reason)
        return written(refusal.reply)
