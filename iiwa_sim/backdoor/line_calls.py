"""What a line of the backdoor's protocol does, whoever brings it: a connection of lines, or HTTP."""

from collections.abc import Coroutine, Iterator
from contextlib import contextmanager

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.backdoor.calls import CALLS, TAKES_TIME
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, EXECUTION, Refused
from iiwa_sim.dialect.wire.help import helped
from iiwa_sim.dialect.wire.line_session import shown
from iiwa_sim.dialect.wire.log import DialectLog
from iiwa_sim.dialect.wire.table import Refusal, Request, Table, load_table

BYE, HELP = "bye", "help"
_EXAMPLE = "push"
_INTERNAL = "internal fault, told in the log"


class NotUnderstood(Refused):
    """A line that is none of the protocol: no such command, or wrong parameters."""


class InternalFault(Refused):
    """A line that was right, and at which we failed."""


class LineCalls:
    """The lines of one who uses the backdoor. What happens to each is told in the log."""

    def __init__(self, backdoor: Backdoor, log: DialectLog, name: str) -> None:
        """`name` tells this one from others in the log."""
        self._backdoor = backdoor
        self._log = log
        self._name = name

    @property
    def table(self) -> Table:
        """The commands, for this robot."""
        return load_table("backdoor", self._backdoor.joint_count)

    def parse(self, line: bytes) -> Request:
        """What a line asks for. Raises NotUnderstood."""
        request = self.table.parse(line)
        if isinstance(request, Refusal):
            raise NotUnderstood(request.code, request.reason)
        if request.beyond:
            raise NotUnderstood(COMMUNICATION_FAILURE, request.too_much().reason)
        return request

    def start(self, request: Request) -> str | Coroutine[None, None, str]:
        """The reply, or, of a command that takes time, what to await for it. Raises Refused."""
        name = request.command.name
        if name in TAKES_TIME:
            return TAKES_TIME[name](self._backdoor, request)
        if name == BYE:
            return BYE
        if name == HELP:
            return helped(self.table, request.phrase, _EXAMPLE)
        return CALLS[name](self._backdoor, request)

    def done(self, line: bytes, reply: str) -> None:
        """A line has been carried out: tell it where that is wanted."""
        if self._log.commands:
            self._log.command(self._name, shown(line), reply)

    @contextmanager
    def telling(self, line: bytes) -> Iterator[None]:
        """Tell why a line is not carried out; what is not refused already is raised as InternalFault.

        A fault of ours must not cost the other side its connection.
        """
        log = self._log
        try:
            yield
        except Refused as refused:
            log.refused(self._name, shown(line), refused.code, refused.reason)
            raise
        except Exception as fault:
            log.exception(self._name, shown(line), fault)
            raise InternalFault(EXECUTION, _INTERNAL) from None
