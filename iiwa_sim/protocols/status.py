"""The status port: the states of the robots as lines of JSON; readers may send `stop`, which all robots do.

Input is read as on the main port, but only `stop` has an effect. Other lines are refused: the log and the
field `error` of later lines tell why. There are no replies, so each line is a state.
"""

from collections.abc import Sequence

import msgspec

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE
from iiwa_sim.controller.state import snapshot
from iiwa_sim.log import SessionLog
from iiwa_sim.protocols.session import LineSession
from iiwa_sim.protocols.table import Refusal, Request

STOP = "stop"
NOTHING_ELSE = f"the status port takes {STOP}, and nothing else"


def status_line(controller: Controller, robot: str = "") -> bytes:
    """Return the present state as a line of JSON, as `protocol/status.schema.json` describes it.

    `robot` is the name of one of several.
    """
    name = b'"robot":%b,' % msgspec.json.encode(robot) if robot else b""
    return b"{" + name + msgspec.json.encode(snapshot(controller))[1:] + b"\n"


class StatusSession(LineSession):
    """One reader of the status port."""

    def __init__(self, controllers: Sequence[Controller], log: SessionLog, name: str) -> None:
        """`controllers` are those of all robots; `name` identifies this connection in the log."""
        super().__init__(controllers[0], log, name, {})
        self.controllers = controllers

    def _reply(self, line: bytes) -> bytes:
        request = self.table.parse(line)
        if isinstance(request, Request) and request.command.name == STOP:
            for controller in self.controllers:
                controller.stop()
        elif line.strip(b" \t"):
            for other in self.controllers[1:]:
                other.errors.record(COMMUNICATION_FAILURE, NOTHING_ELSE)
            self._refuse(line, Refusal(NOTHING_ELSE))
        return b""
