"""The client of a recording, by dialect: it sends the lines of a script and reports the targets of its
moves."""

from typing import NamedTuple, Protocol

from iiwa_sim.cell.cell import Cell
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.force_guard import AXES, Thresholds
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.dialect.iiwa.session import IiwaSession
from iiwa_sim.dialect.krc4.session import Krc4Session
from iiwa_sim.dialect.krc4.short import from_short, is_short, to_xml
from iiwa_sim.dialect.ports import IIWA, KRC4
from iiwa_sim.dialect.wire.table import ERROR, UNKNOWN_COMMAND, Request
from iiwa_sim.dialect.wire.table_file import load_table
from iiwa_sim.frames import Frame, Transform, compose
from iiwa_sim.plot.names import MOVE, named
from iiwa_sim.robot.model import Model

SERVO_MODES = ("smart", "direct")
NORMAL = "normal"


class Asked(NamedTuple):
    """The effect of an accepted line."""

    move: int | None
    """Number of the newest accepted move, if there is any."""
    tcp: Transform | None = None
    """The target of the TCP in the base, if the line has one."""
    blending_mm: float = 0.0
    mode: str = NORMAL
    """Mode of the controller that the line needs."""
    name: str = ""
    """Kind, speed and blending radius (mm) of a move, as `LIN 0.5 r30`."""
    thresholds_n: Thresholds = (None, None, None)


class Client(Protocol):
    """The interface of a client for a recording."""

    def say(self, text: str) -> Asked:
        """Send a line. Raises ValueError with the reason if it is refused."""


class IiwaClient:
    """A client in the iiwa's protocol."""

    def __init__(self, controller: Controller, cell: Cell, name: str) -> None:
        self._cell = cell
        self._model = Model(cell.description)
        self._refusal = _Refusal()
        self._controller = controller
        self._session = IiwaSession(controller, self._refusal, name)

    def say(self, text: str) -> Asked:
        if self._session.closing:
            raise ValueError("nothing is heard after bye")
        line = text.encode()
        self._session.receive(line + b"\n")
        reply = self._session.answer().decode().rstrip()
        if reply in (ERROR, UNKNOWN_COMMAND):
            raise ValueError(f"{reply}: {self._refusal.reason}")
        move, request = self._controller.accepted or None, load_table(IIWA).parse(line)
        if not isinstance(request, Request):
            return Asked(move)
        parameters = [each.name for each in request.command.parameters]
        values = dict(zip(parameters, request.values, strict=True))
        x, y, z = (values.get(f"threshold{axis.upper()}") for axis in AXES)
        name, blending_mm = named(request)
        return Asked(move, self._tcp(request), blending_mm, request.command.mode, name, (x, y, z))

    def _tcp(self, request: Request) -> Transform | None:
        """The target of a move: as it was asked for, else where the moves that wait will end."""
        if not request.command.name.endswith(MOVE):
            return None
        names = [each.name for each in request.command.parameters]
        tool = self._cell.tool_in_flange
        if names[:6] == ["x", "y", "z", "alpha", "beta", "gamma"]:
            pose = Frame(*request.values[:6]).to_transform()
            return compose(pose, tool) if request.command.mode in SERVO_MODES else pose
        count = len(self._cell.description.joints)
        if names[:count] == [f"j{index}" for index in range(count)]:
            return compose(self._model.flange(request.values[:count]), tool)
        return self._controller.tcp(self._controller.end_of_queue)


class Krc4Client:
    """A client in KRC4 messages, in short form or verbatim."""

    def __init__(self, controller: Controller, cell: Cell, name: str) -> None:
        self._cell = cell
        self._model = Model(cell.description)
        self._refusal = _Refusal()
        self._controller = controller
        self._session = _Krc4Session(controller, self._refusal, name)

    def say(self, text: str) -> Asked:
        session = self._session
        session.request = None
        session.receive(to_xml(from_short(text)) if is_short(text) else text.encode())
        if not session.waiting:
            raise ValueError("expected a whole message")
        session.answer(1)
        if self._refusal.reason:
            raise ValueError(self._refusal.reason)
        if session.waiting:
            raise ValueError("expected one message")
        request = session.request
        if request is None:
            return Asked(self._controller.accepted or None)
        return Asked(self._controller.accepted, self._tcp(request), name=request.kind.value)

    def _tcp(self, request: MoveRequest) -> Transform:
        if isinstance(request.target, Frame):
            return request.target.to_transform()
        return compose(self._model.flange(request.target), self._cell.tool_in_flange)


CLIENTS: dict[str, type[IiwaClient] | type[Krc4Client]] = {IIWA: IiwaClient, KRC4: Krc4Client}


class _Krc4Session(Krc4Session):
    """A session that keeps the request of its last message, if that was a move."""

    request: MoveRequest | None = None

    def move(self, request: MoveRequest) -> None:
        self.request = request
        super().move(request)


class _Refusal:
    """A `DialectLog` that keeps the last reason."""

    reason = ""

    def wants_commands(self) -> bool:
        return False

    def command(self, session: str, line: str, reply: str) -> None:
        pass

    def refused(self, session: str, line: str, code: int, reason: str) -> None:
        del session, line, code  # file and line number identify the command
        self.reason = reason

    def ignored(self, session: str, command: str, takes: str, beyond: int) -> None:
        pass

    def odd(self, session: str, command: str, remark: str) -> None:
        pass

    def stopped(self, session: str, vanished: bool) -> None:
        pass

    def exception(self, session: str, line: str, fault: Exception) -> None:
        del session, line
        self.reason = f"internal error, {type(fault).__name__}: {fault}"
