"""The simulator put together: a cell, its controller, the clock that steps it and the servers that talk."""

from collections.abc import Callable, Sequence
from contextlib import AsyncExitStack
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.backdoor.ports import BackdoorPorts
from iiwa_sim.backdoor.recent_dialogue import RecentDialogue
from iiwa_sim.backdoor.token import LOOPBACK, Token
from iiwa_sim.cell.cell import Cell, cell_of
from iiwa_sim.clock.clock import DEFAULT_RATE_HZ
from iiwa_sim.clock.observed import ObservedRobot
from iiwa_sim.clock.pace import REAL, Pace
from iiwa_sim.clock.stepped import Stepped
from iiwa_sim.dialect.dialects import Dialect, dialect_for
from iiwa_sim.dialect.ports import DEFAULT_DIALECT, IIWA, one_each
from iiwa_sim.dialect.session import Session
from iiwa_sim.dialect.status import StatusLines, StatusSession
from iiwa_sim.dialect.wire.wire_faults import WireFaults
from iiwa_sim.log import SessionLog
from iiwa_sim.loop_or_thread import RUNNING
from iiwa_sim.open_ports import OpenPorts
from iiwa_sim.recordings.recordings import Recording, Recordings
from iiwa_sim.robot_in_time import RobotInTime
from iiwa_sim.ros.options import APPLY, NEWEST_RESULT, RosOptions
from iiwa_sim.ros.options import REAL as REAL_STAMPS
from iiwa_sim.serve import status_stream
from iiwa_sim.serve.admission import Admission
from iiwa_sim.serve.budget import Budget
from iiwa_sim.serve.status_stream import StatusStream
from iiwa_sim.serve.tcp import TcpServer
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

    `robot` is the name of a robot that comes along, or a robot's folder; None is the default one. Or `cell`,
    or `robot` where it ends with .toml, is the path of a cell.toml, which names its robot; or one that has
    been read, for simulators that have the same. `clock` says how simulated time passes, "real", "10x" or any
    other multiple, "fast" or "stepped", see `iiwa_sim.clock.clock`; a servo mode ends when it hears of no
    command for `servo_timeout_s`, None for never.

    Each of the `dialects`, "iiwa" and "krc4", is spoken on a port of its own: `port` has one for each, or 0
    for any that are free. All of them move the one robot, and serve their clients together.

    With a `status_port`, 0 for a free one, the robot's state is broadcast there `status_rate_hz` times a
    second of simulated time. With a `rosbridge_port` the robot is on ROS there (docs/ros.md), for clients
    that know the `rosbridge_secret` if there is one; for web pages of this machine and of the
    `rosbridge_origins` (scheme://host[:port]), by the addresses of this machine, localhost and the names
    `rosbridge_hosts`. With `ros` it is a node of ROS 1, of which a process has one; with `ros2` one of ROS 2
    (docs/ros2.md), under `ros_namespace`, in a process of the interpreter `ros2_python`, or of the one that
    `iiwa-sim ros2-env` has made. `ros_result` (a year), `ros_reference`
    ("apply" or "ignore") and `ros_stamps` ("real" or "simulated") are the conventions of their clients.

    With `strict`, a line of the iiwa's protocol with more values than its command takes is an `error`; else
    they are ignored, as by the original, and told in the log.

    With `exclusive`, clients are served one after the other, and in any case the next one `reconnect_pause_s`
    after the last has gone. `on_bye` is called when a client has said bye, as one can in iiwa, and been
    answered: there the caller may leave the context.

    `backdoor` is what a test bench does to robot, cell and wire. With a `backdoor_port`, 0 for a free one, it
    can be reached as lines, too, and with a `backdoor_http_port` as JSON over HTTP; at `backdoor_host`, which
    has to be this machine's own (127.0.0.1, ::1, localhost) unless there is a `backdoor_token`: then whoever
    uses these ports has to know that.

    What is said in the dialects is written into the file `transcript`, for `iiwa-sim replay`
    (docs/transcripts.md); a file that is there is overwritten when the context is entered. So is the file
    `record`, in which the whole run is kept (docs/recordings.md), the state at every tick or `record_rate_hz`
    times in a simulated second.

    Raises CellFault or RobotFault for a cell or a robot that cannot be used, or has not the axes for a
    dialect, RosFault or HttpFault where the library for rosbridge, rospy or HTTP is not installed, and
    ValueError for cell and robot together, for dialects that are none, are named twice, or do not go with the
    ports, for a clock that there is not, a backdoor for other machines without a token, a token that is none,
    a rate outside 100 to 1000 Hz, a status rate outside 1 to 500 Hz or above the rate, or a time outside 0 to
    a day; entering the context raises ListenFault if host and ports cannot be listened on, RosFault where
    there can be no node, and TranscriptFault for a transcript that cannot be written.
    """

    def __init__(
        self,
        robot: str | Path | None = None,
        *,
        cell: str | Path | Cell | None = None,
        dialects: Sequence[str] = (DEFAULT_DIALECT,),
        host: str = "127.0.0.1",
        port: int | Sequence[int] = 0,
        rate_hz: int = DEFAULT_RATE_HZ,
        clock: str | Pace = REAL,
        servo_timeout_s: float | None = None,
        status_port: int | None = None,
        status_rate_hz: int = status_stream.DEFAULT_RATE_HZ,
        rosbridge_port: int | None = None,
        rosbridge_secret: str | None = None,
        rosbridge_origins: Sequence[str] = (),
        rosbridge_hosts: Sequence[str] = (),
        ros: bool = False,
        ros2: bool = False,
        ros2_python: str | Path | None = None,
        ros_namespace: str = "",
        ros_result: int = NEWEST_RESULT,
        ros_reference: str = APPLY,
        ros_stamps: str = REAL_STAMPS,
        strict: bool = False,
        exclusive: bool = False,
        reconnect_pause_s: float = 0.0,
        backdoor_port: int | None = None,
        backdoor_http_port: int | None = None,
        backdoor_host: str = LOOPBACK,
        backdoor_token: str | None = None,
        transcript: str | Path | None = None,
        record: str | Path | None = None,
        record_rate_hz: int | None = None,
        on_bye: Callable[[], None] | None = None,
    ) -> None:
        super().__init__(cell_of(robot, cell), rate_hz, clock, servo_timeout_s)
        self._log = SessionLog()
        self._strict = strict
        faults, admission = WireFaults(self.dialogue.on_wire), Admission(exclusive, reconnect_pause_s)
        self._canned = faults.canned
        self._canned.heard = IIWA in dialects
        budget = Budget(self.clock.catch_up)
        spoken = [dialect_for(name, self.cell.description) for name in dialects]
        self._servers = {
            dialect.name: TcpServer(
                self._session_opener(dialect),
                host,
                own_port,
                admission=admission,
                budget=budget,
                on_answered=self.clock.commanded,
                on_good_bye=on_bye if dialect.says_bye else None,
                faults=faults,
                dialect=dialect.name if len(spoken) > 1 else "",
            )
            for dialect, own_port in zip(spoken, one_each(dialects, port), strict=True)
        }
        self._transcript = None if transcript is None else Path(transcript)
        self._recorder: Recorder | None = None
        self._record = None if record is None else (Path(record), record_rate_hz)
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
        self._backdoor_ports = BackdoorPorts(
            self.backdoor,
            recent,
            self._log,
            host=backdoor_host,
            port=backdoor_port,
            http_port=backdoor_http_port,
            token=None if backdoor_token is None else Token(backdoor_token),
            budget=budget,
        )
        self._status: StatusStream | None = None
        if status_port is not None:
            self._status = StatusStream(
                StatusLines(self._controller).line,
                lambda name: StatusSession(self._controller, self._log, name),
                host,
                status_port,
                rate_hz=status_rate_hz,
                tick_rate_hz=rate_hz,
                on_reader=self.clock.look,
                budget=budget,
            )
        self._ros: RosSide | None = None
        if rosbridge_port is not None or ros or ros2:
            from iiwa_sim.ros import side

            options = RosOptions(
                host=host,
                rosbridge_port=rosbridge_port,
                rosbridge_secret=rosbridge_secret,
                rosbridge_origins=rosbridge_origins,
                rosbridge_hosts=rosbridge_hosts,
                ros=ros,
                ros2=ros2,
                ros2_python=None if ros2_python is None else Path(ros2_python),
                ros_namespace=ros_namespace,
                ros_result=ros_result,
                ros_reference=ros_reference,
                ros_stamps=ros_stamps,
            )
            controller, heard = self._controller, self.clock.commanded
            self._ros = side.RosSide(controller, rate_hz, self._log, options, on_heard=heard, budget=budget)

    async def __aenter__(self) -> Self:
        if self._runs:
            raise RuntimeError(RUNNING)
        async with AsyncExitStack() as listening:
            recorder = None
            if self._transcript is not None:
                recorder = listening.enter_context(self._recording(self._transcript))
            if self._record is not None:
                listening.callback(self._recordings.end, self._recordings.begin(*self._record))
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

    def _session_opener(self, dialect: Dialect) -> Callable[[str], Session]:
        return lambda name: dialect.open_session(
            self._controller, self._log, name, self.dialogue, self._strict, self._canned
        )

    def _recording(self, path: Path) -> Recorder:
        from importlib import metadata

        title = f"{self.cell.description.name}, recorded by iiwa-sim {metadata.version('iiwa-sim')}"
        return Recorder(path, self.dialogue, self.clock.tick_s, title, list(self._servers))
