r"""The iiwa's line protocol: bytes of one connection in, calls on the controller, replies out.

Each line is answered by one line that ends with `\r\n`, in the order in which they came. The session knows no
sockets: a shell hands it bytes and asks for answers while there are lines waiting.
"""

from collections.abc import Sequence

from iiwa_sim.controller.controller import Controller
from iiwa_sim.protocols.iiwa.commands import COMMANDS
from iiwa_sim.protocols.ports import IIWA
from iiwa_sim.protocols.wire.canned import CannedReplies
from iiwa_sim.protocols.wire.decimals import format_decimals
from iiwa_sim.protocols.wire.dialogue import Dialogue
from iiwa_sim.protocols.wire.line_session import CommandSession
from iiwa_sim.protocols.wire.log import ProtocolLog
from iiwa_sim.protocols.wire.own_moves import OwnMoves
from iiwa_sim.protocols.wire.table_file import load_table


class IiwaSession(CommandSession):
    """One connection to the robot.

    A move, or a check whether one is possible, ends a batch of replies: plans in numbers do not delay ticks.
    """

    def __init__(
        self,
        controller: Controller,
        log: ProtocolLog,
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
        table = load_table(IIWA)
        super().__init__(controller, log, name, table, COMMANDS, dialogue, strict=strict, canned=canned)
        self.moves = OwnMoves()
        self._written: dict[str, tuple[tuple[float, ...], bytes]] = {}
        self.dialogue.event(name, "connected", IIWA)

    def _moved_last(self) -> bool:
        return self.controller.accepted in self.moves

    def lost(self) -> None:
        """Notice that the connection has gone: stop the robot if a move of this session is pending."""
        super().lost()
        self.dialogue.event(self.name, "disconnected")
        self.moves.abandon(self.controller, self.log, self.name)

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
