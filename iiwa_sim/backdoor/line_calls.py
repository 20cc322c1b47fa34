"""Carries out lines of the backdoor's protocol, from a line connection or over HTTP."""

from collections.abc import Coroutine, Iterator
from contextlib import contextmanager

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.backdoor.calls import call
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, EXECUTION, Refused
from iiwa_sim.protocols.session import ProtocolLog, shown
from iiwa_sim.protocols.table import Refusal, Request, Table, helped, load_table

BYE, HELP, RELEASE_WHEN_GONE = "bye", "help", "release when gone"
_EXAMPLE = "push"
_INTERNAL = "internal error, see the log"


class NotUnderstood(Refused):
    """The line has no such command, or wrong parameters."""


class InternalError(Refused):
    """The line was right, and an internal error occurred."""


class LineCalls:
    """The lines of one client. Each is logged with its outcome."""

    def __init__(self, backdoor: Backdoor, log: ProtocolLog, name: str) -> None:
        """`name` identifies this client in the log."""
        self._backdoor = backdoor
        self._log = log
        self._name = name

    @property
    def table(self) -> Table:
        """The commands, for this robot."""
        return load_table("backdoor", self._backdoor.joint_count)

    def parse(self, line: bytes) -> Request:
        """Parse a line. Raises NotUnderstood, also for values behind a command that takes none.

        `emergency stop : 0` may be meant to release it, so it does not press it.
        """
        request = self.table.parse(line)
        if isinstance(request, Refusal):
            raise NotUnderstood(request.code, request.reason)
        if request.beyond:
            raise NotUnderstood(COMMUNICATION_FAILURE, request.too_much().reason)
        command, given = request.command, line.partition(b":")[2].split()
        if given and not (command.parameters or command.phrase):
            reason = f"{command.name} takes no values, got {len(given)}"
            raise NotUnderstood(COMMUNICATION_FAILURE, reason)
        return request

    def start(self, request: Request, line: bytes) -> str | Coroutine[None, None, str]:
        """The reply, or an awaitable for a command that takes time. Raises Refused.

        The dialogue has the `line` that is parsed if it changes something or is refused.
        """
        name = request.command.name
        if name == BYE:
            return BYE
        if name == RELEASE_WHEN_GONE:
            return request.command.reply_words[0]
        if name == HELP:
            return helped(self.table, request.phrase, _EXAMPLE)
        with self._backdoor.by_line(self._name, shown(line)):
            return call(self._backdoor, request)

    def done(self, line: bytes, reply: str) -> None:
        """Log that a line has been carried out, if that is wanted."""
        if self._log.wants_commands():
            self._log.command(self._name, shown(line), reply)

    @contextmanager
    def telling(self, line: bytes) -> Iterator[None]:
        """Log why a line is not carried out; an exception that is no refusal is raised as InternalError.

        An internal error must not cost the client its connection.
        """
        log = self._log
        try:
            yield
        except Refused as refused:
            log.refused(self._name, shown(line), refused.code, refused.reason)
            raise
        except Exception as fault:
            log.exception(self._name, shown(line), fault)
            raise InternalError(EXECUTION, _INTERNAL) from None
