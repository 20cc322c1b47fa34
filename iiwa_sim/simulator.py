"""The simulator put together: a cell, its controller, the clock that steps it and the server that talks."""

from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

from iiwa_sim.cell.cell import load_cell, robot_alone
from iiwa_sim.clock import DEFAULT_RATE_HZ, RealTimeClock
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.force_guard import Contact
from iiwa_sim.controller.io import Io
from iiwa_sim.dialect.dialogue import Dialogue
from iiwa_sim.dialect.iiwa import Session
from iiwa_sim.dialect.status import StatusSession, status_line
from iiwa_sim.log import SessionLog, robot_contact, robot_fault
from iiwa_sim.robot.description import DEFAULT_ROBOT
from iiwa_sim.serve import status_stream
from iiwa_sim.serve.status_stream import StatusStream
from iiwa_sim.serve.tcp import TcpServer
from iiwa_sim.serve.turns import Turns


class Simulator:
    """A robot that listens and moves while the context is open, inside the caller's asyncio loop.

        async with Simulator("lbr_iiwa_14_r820") as simulator:
            reader, writer = await asyncio.open_connection(simulator.host, simulator.port)

    `robot` is the name of a robot that comes along, or a robot's folder; None is the default one. Or `cell`
    is the path of a cell.toml, which names its robot. `port` 0 picks a free port; a servo mode ends when it
    hears of no command for `servo_timeout_s`, None for never.

    With a `status_port`, 0 for a free one, the robot's state is broadcast there `status_rate_hz` times a
    second of simulated time. With `exclusive`, clients are served one after the other, and in any case the
    next one `reconnect_pause_s` after the last has gone. `on_bye` is called when a client has said bye and
    been answered: there the caller may leave the context.

    Raises CellFault or RobotFault for a cell or a robot that cannot be used, and ValueError for both
    together, a rate outside 100 to 1000 Hz, a status rate outside 1 to 500 Hz or above the rate, or a time
    outside 0 to a day; entering the context raises ListenFault if host and ports cannot be listened on.
    """

    def __init__(
        self,
        robot: str | Path | None = None,
        *,
        cell: str | Path | None = None,
        host: str = "127.0.0.1",
        port: int = 0,
        rate_hz: int = DEFAULT_RATE_HZ,
        servo_timeout_s: float | None = None,
        status_port: int | None = None,
        status_rate_hz: int = status_stream.DEFAULT_RATE_HZ,
        exclusive: bool = False,
        reconnect_pause_s: float = 0.0,
        on_bye: Callable[[], None] | None = None,
    ) -> None:
        if robot is not None and cell is not None:
            raise ValueError("robot and cell are both given, expected one of them: the cell names its robot")
        if cell is None:
            self.cell = robot_alone(DEFAULT_ROBOT if robot is None else robot)
        else:
            self.cell = load_cell(cell)
        self._clock = RealTimeClock(rate_hz)
        self.controller = Controller(
            self.cell.description,
            self._clock.tick_s,
            start=self.cell.start,
            tool_in_flange=self.cell.tool_in_flange,
            world=self.cell.world(),
            noise=self.cell.noise(),
            io=Io(self.cell.input_names, self.cell.output_names),
            servo_timeout_s=servo_timeout_s,
            on_fault=self._robot_fault,
            on_contact=self._robot_contact,
        )
        self.dialogue = Dialogue(lambda: self.controller.tick)
        """What is said on the main port; `dialogue.listeners.append(listener)` hears it."""
        self._log = SessionLog()
        self._server = TcpServer(
            self._open_session, host, port, turns=Turns(exclusive, reconnect_pause_s), on_good_bye=on_bye
        )
        self._status: StatusStream | None = None
        if status_port is not None:
            self._status = StatusStream(
                self._status_line,
                self._open_status_session,
                host,
                status_port,
                rate_hz=status_rate_hz,
                tick_rate_hz=rate_hz,
            )

    @property
    def host(self) -> str:
        """Address listened on."""
        return self._server.address[0]

    @property
    def port(self) -> int:
        """Port listened on."""
        return self._server.address[1]

    @property
    def status_port(self) -> int | None:
        """Port on which the state is broadcast, if it is."""
        return None if self._status is None else self._status.address[1]

    async def __aenter__(self) -> Self:
        await self._server.start()
        try:
            if self._status is not None:
                await self._status.start()
        except BaseException:
            await self._server.close()
            raise
        self._clock.start(self.controller.step if self._status is None else self._step)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, where: TracebackType | None
    ) -> None:
        self.controller.stop()  # or the log would say that the clients have vanished
        try:
            await self._server.close()
            if self._status is not None:
                await self._status.close()
        finally:
            self._clock.stop()

    def _step(self) -> None:
        try:
            self.controller.step()
        finally:  # a robot that fails is still seen
            if self._status is not None:
                self._status.tick()

    def _status_line(self) -> bytes:
        return status_line(self.controller)

    def _open_status_session(self, name: str) -> StatusSession:
        return StatusSession(self.controller, self._log, name)

    def _open_session(self, name: str) -> Session:
        return Session(self.controller, self._log, name, self.dialogue)

    def _robot_fault(self, code: int, reason: str) -> None:
        robot_fault(code, reason)
        self.dialogue.event("robot", f"{code} {reason}")

    def _robot_contact(self, contact: Contact) -> None:
        robot_contact(contact)
        self.dialogue.event("robot", str(contact))
