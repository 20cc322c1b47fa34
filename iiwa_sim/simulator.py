"""The simulator put together: a cell, its controller, the clock that steps it and the servers that talk."""

from collections.abc import Callable
from contextlib import AsyncExitStack
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.backdoor.recent_dialogue import RecentDialogue
from iiwa_sim.cell.cell import Cell, cell_of
from iiwa_sim.clock.observed import ObservedRobot, Stepped
from iiwa_sim.log import SessionLog
from iiwa_sim.loop_or_thread import RUNNING
from iiwa_sim.open_ports import OpenPorts
from iiwa_sim.options.model import Settings
from iiwa_sim.options.robots import from_keywords
from iiwa_sim.protocols.faults import WireFaults
from iiwa_sim.protocols.ports import IIWA
from iiwa_sim.protocols.protocols import Protocol, protocol_for
from iiwa_sim.protocols.session import Session
from iiwa_sim.protocols.status import StatusLines, StatusSession
from iiwa_sim.recordings.recordings import Recording, Recordings
from iiwa_sim.robot_in_time import RobotInTime
from iiwa_sim.server.admission import Admission
from iiwa_sim.server.budget import Budget
from iiwa_sim.server.status_stream import StatusStream
from iiwa_sim.server.tcp import TcpServer
from iiwa_sim.server.token import Token, word_of
from iiwa_sim.transcript.record import Recorder

if TYPE_CHECKING:
    from iiwa_sim.ros.side import RosSide


class Simulator(OpenPorts, RobotInTime):
    """A robot that listens and moves while the context is open: in a thread of its own,

    with Simulator("lbr_iiwa_14_r820", clock="fast") as simulator: driver = MyDriver(simulator.host,
    simulator.port)

    or inside the caller's asyncio loop.

    async with Simulator() as simulator: reader, writer = await asyncio.open_connection(simulator.host,
    simulator.port)

    With a thread, the methods here may be called from any other thread, and wait until they are done; what
    else there is (`controller`, `clock`, `dialogue`) belongs to the thread: reach it through `call`. In a
    loop, the methods that let time pass raise RuntimeError: there, await those of `clock`.

    `settings` holds what the robot is and does; keywords are fields of `Settings` and hold before it. Ports
    are free ones if none is given.

    Args:
        robot: Name of a built-in robot, a robot's folder, or the path of a cell.toml.
        cell: Path of a cell.toml, or a cell that has been read, for simulators that have the same.
        settings: Options, such as `Settings(clock="fast")`.
        on_bye: Called when a client has said bye and been answered: there the caller may leave the context.
        options: Options by the names of `Settings`, such as `clock="fast"`.

    Raises:
        SettingError: An option is unknown, has a wrong value, or does not fit to another.
        CellFault, RobotFault: Cell or robot cannot be used, or has not the axes for a protocol.
        RosFault: The library for rosbridge or rospy is not installed.

    Entering the context raises ListenFault if host and ports cannot be listened on, RosFault if there can be
    no node, and TranscriptFault or RecordingFault for a file that cannot be written.
    """

    def __init__(
        self,
        robot: str | Path | None = None,
        *,
        cell: str | Path | Cell | None = None,
        settings: Settings | None = None,
        on_bye: Callable[[], None] | None = None,
        **options: Any,
    ) -> None:
        known = cell if isinstance(cell, Cell) else None
        named = {"robot": robot, "cell": None if known else cell}
        self.settings = settings = from_keywords(named | options, settings)
        found = known or cell_of(settings.robot, settings.cell)
        super().__init__(found, settings.rate_hz, settings.clock, settings.servo_timeout_s)
        self._log = SessionLog()
        faults = WireFaults(self.dialogue.on_wire)
        admission = Admission(settings.exclusive, settings.reconnect_pause_s)
        self._canned = faults.canned
        self._canned.heard = IIWA in settings.protocol
        budget = Budget(self.clock.catch_up)
        spoken = [protocol_for(name, self.cell.description) for name in settings.protocol]
        self._servers = {
            protocol.name: TcpServer(
                self._session_opener(protocol),
                settings.host,
                port,
                admission=admission,
                budget=budget,
                on_answered=self.clock.commanded,
                on_good_bye=on_bye if protocol.says_bye else None,
                faults=faults,
                protocol=protocol.name if len(spoken) > 1 else "",
            )
            for protocol, port in zip(spoken, settings.port, strict=True)
        }
        self._recorder: Recorder | None = None
        recent = RecentDialogue(self.dialogue, self.clock.tick_s)
        ports = list(self._servers.values())
        self.backdoor = Backdoor(self._controller, faults, ports, self.clock, recent, self.call)
        self._recordings = Recordings(
            self._controller,
            self.cell,
            self.clock,
            self.dialogue,
            faults,
            self.backdoor,
            self._log,
            self._events,
            list(self._servers),
            on_change=lambda: self.clock.drive(self._watched()),
        )
        self._backdoor_http = None
        if settings.backdoor_port is not None:
            from iiwa_sim.backdoor.http import BackdoorHttp

            recent.listen()
            word = word_of(settings.backdoor_token, settings.backdoor_token_file)
            token = None if word is None else Token(word)
            self._backdoor_http = BackdoorHttp(
                self.backdoor, self._log, settings.backdoor_host, settings.backdoor_port, token
            )
        self._status: StatusStream | None = None
        if settings.status_port is not None:
            self._status = StatusStream(
                StatusLines(self._controller).line,
                lambda name: StatusSession(self._controller, self._log, name),
                settings.host,
                settings.status_port,
                rate_hz=settings.status_rate_hz,
                tick_rate_hz=settings.rate_hz,
                on_reader=self.clock.look,
                budget=budget,
            )
        self._ros: RosSide | None = None
        if settings.rosbridge_port is not None or settings.ros or settings.ros2:
            from iiwa_sim.ros import side

            self._ros = side.RosSide(self._controller, self._log, settings, self.clock)

    async def __aenter__(self) -> Self:
        if self._runs:
            raise RuntimeError(RUNNING)
        async with AsyncExitStack() as listening:
            recorder = None
            if self.settings.transcript is not None:
                recorder = listening.enter_context(self._recording(Path(self.settings.transcript)))
            if self.settings.record is not None:
                begun = self._recordings.begin(Path(self.settings.record), self.settings.record_rate_hz)
                listening.callback(self._recordings.end, begun)
            await self._open(listening)
            listening.pop_all()
            self._recorder = recorder
        self.clock.start(self._watched())
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, where: TracebackType | None
    ) -> None:
        self._controller.stop()  # or the log would say that the clients have vanished
        try:
            await self._close()
        finally:
            self.clock.stop()
            if self._recorder is not None:
                self._recorder.close()
                self._recorder = None
            self._recordings.end_all()

    def reply(self, command: str, reply: str, times: int = 1) -> None:
        """Have the next `times` lines of a command answered by `reply`, and not carried out.

        `command` is a name such as "get status"; `times` is 0 for all lines until `backdoor.clear_faults()`.
        Several for one command take its lines one after the other. Raises ValueError for a command there is
        not, a reply that is not one line of printable ASCII, a number below 0, and where the iiwa's protocol
        is not spoken: KRC4 messages cannot be canned.
        """
        self.call(lambda: self._canned.set(command, reply, times))

    def record(self, path: str | Path, rate_hz: int | None = None) -> Recording:
        """Write a recording into a file from now on, as docs/recordings.md has it; one that is there is lost.

        The state is written at every tick, or `rate_hz` times in a simulated second. It goes on until the
        context of what this gives is left, or `close` is called, or the simulator ends. Raises RecordingFault
        where the file cannot be written or the library mcap is not installed, and ValueError for a rate
        outside 1 to that of the ticks.
        """
        return self._recordings.recording(Path(path), rate_hz, self.call)

    def _watched(self) -> Stepped:
        """The robot for the clock; with nobody else in between where nobody watches."""
        others = [each for each in (self._status, self._ros) if each is not None]
        watchers = [*self._recordings.recorders, *others]
        return ObservedRobot(self._controller, watchers) if watchers else self._controller

    def _session_opener(self, protocol: Protocol) -> Callable[[str], Session]:
        return lambda name: protocol.open_session(
            self._controller, self._log, name, self.dialogue, self.settings.strict, self._canned
        )

    def _recording(self, path: Path) -> Recorder:
        from importlib import metadata

        title = f"{self.cell.description.name}, recorded by iiwa-sim {metadata.version('iiwa-sim')}"
        return Recorder(path, self.dialogue, self.clock.tick_s, title, list(self._servers))
