"""The status port: the robot's state as lines of JSON; readers may send `stop`.

Input is read as on the main port, but only `stop` has an effect. Other lines are refused: the log and the
field `error` of later lines tell why. There are no replies, so each line is a state.
"""

import msgspec

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, EXECUTION
from iiwa_sim.controller.snapshot import snapshot
from iiwa_sim.dialect.wire.line_session import LINES_AT_ONCE, LineSession, shown
from iiwa_sim.dialect.wire.lines import WONT_TIMING_MARK
from iiwa_sim.dialect.wire.log import DialectLog
from iiwa_sim.dialect.wire.table import Request
from iiwa_sim.dialect.wire.table_file import load_table

STOP = "stop"
NOTHING_ELSE = f"the status port takes {STOP}, and nothing else"

_encoder = msgspec.json.Encoder()


def status_line(controller: Controller) -> bytes:
    """The present state as a line of JSON, as `protocol/status.schema.json` describes it."""
    return _encoder.encode(snapshot(controller)) + b"\n"


class StatusSession(LineSession):
    """One reader of the status port."""

    def __init__(self, controller: Controller, log: DialectLog, name: str) -> None:
        """`name` identifies this connection in the log."""
        super().__init__(log, name)
        self._controller = controller
        self._table = load_table("iiwa")

    def answer(self, most: int = LINES_AT_ONCE) -> bytes:
        """Carry out the next waiting lines; returns what telnet has to be answered, once for all of them."""
        return super().answer(most)[: len(WONT_TIMING_MARK)]

    def _reply(self, line: bytes) -> bytes:
        request = self._table.parse(line)
        if isinstance(request, Request) and request.command.name == STOP:
            self._stop()
        elif line.strip(b" \t"):
            self.log.refused(self.name, shown(line), COMMUNICATION_FAILURE, NOTHING_ELSE)
            self._controller.record_error(COMMUNICATION_FAILURE, NOTHING_ELSE)
        return b""

    def _stop(self) -> None:
        try:
            self._controller.stop()
        except Exception as exception:  # an internal error must not cost the reader its connection
            self.log.exception(self.name, STOP, exception)
            self._controller.record_error(EXECUTION, f"internal fault at '{STOP}', told in the log")
        else:
            if self.log.commands:
                self.log.command(self.name, STOP, "done")
