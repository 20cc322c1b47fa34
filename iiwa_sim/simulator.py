"""The simulator put together: a robot, its controller, the clock that steps it and the server that talks."""

from pathlib import Path
from types import TracebackType
from typing import Self

from iiwa_sim.clock import DEFAULT_RATE_HZ, RealTimeClock
from iiwa_sim.controller.controller import Controller
from iiwa_sim.dialect.iiwa import Session
from iiwa_sim.log import SessionLog, robot_fault
from iiwa_sim.robot.description import DEFAULT_ROBOT, load_robot
from iiwa_sim.serve.tcp import TcpServer


class Simulator:
    """A robot that listens and moves while the context is open, inside the caller's asyncio loop.

        async with Simulator("lbr_iiwa_14_r820") as simulator:
            reader, writer = await asyncio.open_connection(simulator.host, simulator.port)

    `robot` is the name of a robot that comes along, or a robot's folder; `port` 0 picks a free port; a servo
    mode ends when it hears of no command for `servo_timeout_s`, None for never. Raises RobotFault for a robot
    that cannot be used and ValueError for a rate outside 100 to 1000 Hz or a timeout outside 0 to a day;
    entering the context raises ListenFault if host and port cannot be listened on.
    """

    def __init__(
        self,
        robot: str | Path = DEFAULT_ROBOT,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        rate_hz: int = DEFAULT_RATE_HZ,
        servo_timeout_s: float | None = None,
    ) -> None:
        self.description = load_robot(robot)
        self._clock = RealTimeClock(rate_hz)
        self.controller = Controller(
            self.description, self._clock.tick_s, servo_timeout_s=servo_timeout_s, on_fault=robot_fault
        )
        self._log = SessionLog()
        self._server = TcpServer(self._open_session, host, port)

    @property
    def host(self) -> str:
        """Address listened on."""
        return self._server.address[0]

    @property
    def port(self) -> int:
        """Port listened on."""
        return self._server.address[1]

    async def __aenter__(self) -> Self:
        await self._server.start()
        self._clock.start(self.controller.step)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, where: TracebackType | None
    ) -> None:
        self.controller.stop()  # or the log would say that the clients have vanished
        try:
            await self._server.close()
        finally:
            self._clock.stop()

    def _open_session(self, name: str) -> Session:
        return Session(self.controller, self._log, name)
