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
from iiwa_sim.protocols.session import LineSession, written
from iiwa_sim.protocols.table import Refusal, Request, Table, load_table

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
        table = Table({STOP: load_table("iiwa").commands[STOP]})
        super().__init__(controllers[0], log, name, table, {STOP: _stop})
        self.controllers = controllers

    def _reply(self, line: bytes) -> bytes:
        if line.strip(b" \t"):
            super()._reply(line)
        return b""

    def _refuse(self, line: bytes, refusal: Refusal) -> bytes:
        for other in self.controllers[1:]:
            other.errors.record(COMMUNICATION_FAILURE, NOTHING_ELSE)
        return super()._refuse(line, refusal._replace(code=COMMUNICATION_FAILURE, reason=NOTHING_ELSE))


def _stop(session: StatusSession, _: Request) -> bytes:
    for controller in session.controllers:
        controller.stop()
    return written("done")
