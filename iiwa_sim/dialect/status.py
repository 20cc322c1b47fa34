"""The status port: the robot's state as lines of JSON, and `stop` in the other direction.

What a reader sends is read as on the main port, but only `stop` does anything. All else is refused: the log
and the `error` of the lines that follow tell why. Nothing is replied, so that each line is a state.
"""

import msgspec

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, EXECUTION
from iiwa_sim.controller.snapshot import snapshot
from iiwa_sim.dialect.wire.decimals import readable
from iiwa_sim.dialect.wire.lines import OVERLONG, TIMING_MARK, WONT_TIMING_MARK, LineSplitter
from iiwa_sim.dialect.wire.log import DialectLog
from iiwa_sim.dialect.wire.table import Request, load_table

STOP = "stop"
NOTHING_ELSE = f"the status port takes {STOP}, and nothing else"

_encoder = msgspec.json.Encoder()


def status_line(controller: Controller) -> bytes:
    r"""The present state, as `protocol/status.schema.json` describes it, with a `\n`."""
    return _encoder.encode(snapshot(controller)) + b"\n"


class StatusSession:
    """What one reader says."""

    def __init__(self, controller: Controller, log: DialectLog, name: str) -> None:
        """`name` tells this connection from others in the log."""
        self._controller = controller
        self._log = log
        self._name = name
        self._table = load_table("iiwa")
        self._splitter = LineSplitter()

    def receive(self, data: bytes) -> bytes:
        """Bytes from the reader; gives what telnet has to be told, which is no line."""
        asked = False
        for line in self._splitter.feed(data):
            if line is TIMING_MARK:
                asked = True
            else:
                self._obey(line)
        return WONT_TIMING_MARK if asked else b""

    def end(self) -> None:
        """The reader sends no more; what it sent last counts as a line, with or without a line end."""
        for line in self._splitter.finish():
            self._obey(line)

    def _obey(self, line: bytes) -> None:
        request = self._table.parse(line)
        if isinstance(request, Request) and request.command.name == STOP:
            self._stop()
        elif line.strip(b" \t"):
            text = "(too long)" if line is OVERLONG else readable(line)
            self._log.refused(self._name, text, COMMUNICATION_FAILURE, NOTHING_ELSE)
            self._controller.record_error(COMMUNICATION_FAILURE, NOTHING_ELSE)

    def _stop(self) -> None:
        log = self._log
        try:
            self._controller.stop()
        except Exception as fault:  # a fault of ours must not cost the reader its connection
            log.exception(self._name, STOP, fault)
            self._controller.record_error(EXECUTION, f"internal fault at '{STOP}', told in the log")
        else:
            if log.commands:
                log.command(self._name, STOP, "done")
