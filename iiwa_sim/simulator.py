"""The simulator put together: a cell, its controller, the clock that steps it and the servers that talk."""

import logging
from collections.abc import Callable, Coroutine
from contextlib import AsyncExitStack
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypeVar

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.cell.cell import Cell, cells_of, single
from iiwa_sim.clock.clock import Clock
from iiwa_sim.clock.observed import ObservedRobot, Stepped
from iiwa_sim.clock.pace import Pace, pace
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.state import Snapshot, snapshot
from iiwa_sim.dialogue import Dialogue
from iiwa_sim.log import SessionLog
from iiwa_sim.loop_thread import LoopThread
from iiwa_sim.motion.joints import Joints
from iiwa_sim.options.model import Settings
from iiwa_sim.options.robots import from_keywords
from iiwa_sim.protocols.faults import WireFaults
from iiwa_sim.protocols.ports import IIWA
from iiwa_sim.protocols.protocols import check_axes, command_names, open_session
from iiwa_sim.protocols.session import Session
from iiwa_sim.protocols.status import StatusSession, status_line
from iiwa_sim.recordings.recordings import Recording, Recordings
from iiwa_sim.robot.urdf_check import differing_limits
from iiwa_sim.robot_events import RobotEvents, log_discarded
from iiwa_sim.server.budget import Budget
from iiwa_sim.server.listening import Acceptor
from iiwa_sim.server.status_stream import StatusStream
from iiwa_sim.server.tcp import Admission, TcpServer
from iiwa_sim.server.token import Token, word_of
from iiwa_sim.transcript.record import Recorder

if TYPE_CHECKING:
    from iiwa_sim.backdoor.http import BackdoorHttp
    from iiwa_sim.ros.side import RosSide

LEAVE_S = 10.0
"""Seconds that the thread has to leave the context before it counts as blocked."""
RUNNING = "the simulator runs already"

T = TypeVar("T")
logger = logging.getLogger(__name__)


class Simulator:
    """Simulated robot that listens on its ports while its context is open.

    `with Simulator(clock="fast") as robot:` runs it in a thread of its own, `async with` in the caller's
    asyncio loop. A driver connects to `robot.host` and `robot.port`, free ports unless options name them.

    With a thread, any other thread may call the methods here; each returns when it is done. `controller`,
    `clock` and `dialogue` belong to the robot's thread: reach them through `call`. In a loop, methods that
    let time pass raise RuntimeError: await those of `clock`.

    Args:
        robot: Name of a built-in robot, a robot's folder, or the path of a cell.toml.
        cell: Path of a cell.toml, or a loaded cell.
        settings: Options, such as `Settings(clock="fast")`; keywords precede them.
        on_bye: Called after the reply to a `bye`; the caller may leave the context there.
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
        self._thread: LoopThread | None = None
        self.cell = known or single(cells_of(settings.robot, settings.cell))
        for line in differing_limits(self.cell.description):
            logger.warning("%s", line)
        self.clock = Clock(settings.rate_hz, _pace(settings.clock))
        self.dialogue = Dialogue(self._tick, self.clock.tick_s, command_names)
        """The dialogue in all protocols. It can be asked for from `dialogue.remember()` on."""
        self._events = RobotEvents(self.dialogue)
        self._controller = self.cell.controller(
            self.clock.tick_s,
            servo_timeout_s=settings.servo_timeout_s,
            on_fault=self._events.fault,
            on_contact=self._events.contact,
            on_touch=self._events.touch,
        )
        self._controller.endings.on_discarded = log_discarded
        if self._controller.handling is not None:
            self._controller.handling.tell_of_parts(self._events.part)
        self._log = SessionLog()
        faults = WireFaults(self.dialogue.on_wire)
        admission = Admission(settings.exclusive, settings.reconnect_pause_s)
        self._canned = faults.canned
        self._canned.heard = IIWA in settings.protocol
        budget = Budget(self.clock.catch_up)
        for protocol in settings.protocol:
            check_axes(protocol, self.cell.description)
        self._servers = {
            protocol: TcpServer(
                partial(self._open_session, protocol),
                settings.host,
                port,
                admission=admission,
                budget=budget,
                on_answered=self.clock.commanded,
                on_good_bye=on_bye if protocol == IIWA else None,
                faults=faults,
                protocol=protocol if len(settings.protocol) > 1 else "",
            )
            for protocol, port in zip(settings.protocol, settings.port, strict=True)
        }
        self._recorder: Recorder | None = None
        self.backdoor = Backdoor(
            self._controller, faults, self._acceptors, self.clock, self.dialogue, self.call
        )
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
        self._backdoor_http: BackdoorHttp | None = None
        if settings.backdoor_port is not None:
            from iiwa_sim.backdoor import http

            self.dialogue.remember()
            word = word_of(settings.backdoor_token, settings.backdoor_token_file)
            token = None if word is None else Token(word)
            self._backdoor_http = http.BackdoorHttp(
                self.backdoor, self._log, settings.backdoor_host, settings.backdoor_port, token
            )
        self._status: StatusStream | None = None
        if settings.status_port is not None:
            self._status = StatusStream(
                partial(status_line, self._controller),
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
            for server in self._listeners:
                await server.start()
                listening.push_async_callback(server.close)
            listening.pop_all()
            self._recorder = recorder
        self.clock.start(self._watched())
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, where: TracebackType | None
    ) -> None:
        self._controller.stop()  # or the log would say that the clients have vanished
        try:
            for server in reversed(self._listeners):
                await server.close()
        finally:
            self.clock.stop()
            if self._recorder is not None:
                self._recorder.close()
                self._recorder = None
            self._recordings.end_all()

    def __enter__(self) -> Self:
        if self._thread is not None or self._runs:
            raise RuntimeError(RUNNING)
        self._thread = LoopThread("iiwa-sim")
        try:
            return self._thread.wait_for(self.__aenter__)
        except BaseException:
            self._leave(self._thread)
            raise

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, where: TracebackType | None
    ) -> None:
        if self._thread is not None:
            self._leave(self._thread)

    def call(self, function: Callable[[], T], limit_s: float | None = None) -> T:
        """The result of `function`, called between two ticks in the robot's thread; raises what it raises.

        Raises TimeoutError, naming what blocks the thread, if that takes more than `limit_s`. If the thread
        has ended, or there is none, the function is called at once.
        """

        async def called() -> T:
            return self._called(function)

        if self._thread is None or self._thread.current:
            return self._called(function)
        return self._thread.wait_for(called, limit_s)

    @property
    def controller(self) -> Controller:
        """The robot's controller, as of now.

        To be had anew whenever something is asked of it or begun: a robot at rest does not tick until then.
        """
        return self.call(self._in_hand)

    @property
    def joints(self) -> Joints:
        """Joint positions (rad)."""
        return self.call(lambda: self._controller.joints)

    def state(self) -> Snapshot:
        """The whole state of the robot, of one tick; the last one after the context has ended."""
        return self.call(lambda: snapshot(self._controller))

    def advance(self, seconds: float) -> None:
        """Let simulated time pass as fast as possible, with any clock.

        Args:
            seconds: Simulated time, 0 to a day; part of a tick counts as a whole one.

        Raises:
            ValueError: The time is out of range.
        """
        self._wait_for(lambda: self.clock.advance(seconds))

    def run_until_stopped(self, limit_s: float = 60.0) -> float:
        """Let time pass, as fast as possible, until the robot has stopped.

        Args:
            limit_s: Longest simulated time, 0 to a day.

        Returns:
            Simulated time that has passed (s); 0 if the robot did not move.

        Raises:
            StillMoving: The robot still moves after `limit_s`. It is a TimeoutError.
        """
        return self._wait_for(lambda: self.clock.run_until_stopped(limit_s))

    def pause(self) -> None:
        """Suspend simulated time until `resume`, except for `advance` and `run_until_stopped`."""
        self.call(self.clock.pause)

    def resume(self) -> None:
        """Resume simulated time."""
        self.call(self.clock.resume)

    def set_clock(self, clock: str | Pace) -> None:
        """Set the clock: "real", "10x", "fast" or "stepped". Raises ValueError for others."""
        wanted = _pace(clock)
        self.call(lambda: self.clock.set_pace(wanted))

    def reply(self, command: str, reply: str, times: int = 1) -> None:
        """Answer the next `times` occurrences of a command with `reply` without executing it.

        Several replies for one command follow one another. KRC4 messages cannot be canned.

        Args:
            command: Name such as "get status".
            reply: One line of printable ASCII.
            times: Number of lines, or 0 for all until `backdoor.clear_faults()`.

        Raises:
            ValueError: Unknown command, wrong reply or number, or a robot without the text protocol.
        """
        self.call(lambda: self._canned.set(command, reply, times))

    def record(self, path: str | Path, rate_hz: int | None = None) -> Recording:
        """Record from now on into a file, which is overwritten: see docs/recordings.md.

        Args:
            path: MCAP file.
            rate_hz: States per simulated second, 1 to the tick rate; every tick if None.

        Returns:
            The recording: it ends with its context, by `close`, or with the simulator.

        Raises:
            RecordingFault: The file cannot be written, or mcap is not installed.
            ValueError: The rate is out of range.
        """
        return self._recordings.recording(Path(path), rate_hz, self.call)

    @property
    def host(self) -> str:
        """Address listened on."""
        return self._first.address[0]

    @property
    def port(self) -> int:
        """Port listened on, that of the first protocol."""
        return self._first.address[1]

    @property
    def ports(self) -> dict[str, int]:
        """Port of each protocol, in the order in which they were named."""
        return {name: server.address[1] for name, server in self._servers.items()}

    @property
    def _first(self) -> TcpServer:
        return next(iter(self._servers.values()))

    @property
    def status_port(self) -> int | None:
        """Port on which the state is broadcast, if it is."""
        return None if self._status is None else self._status.address[1]

    @property
    def rosbridge_port(self) -> int | None:
        """Port on which the robot is on ROS by rosbridge, if it is."""
        address = None if self._ros is None else self._ros.rosbridge_address
        return None if address is None else address[1]

    @property
    def ros2_node(self) -> str | None:
        """The name of the node of ROS 2 that the robot is, if it is one."""
        return None if self._ros is None else self._ros.ros2_node

    @property
    def ros_master(self) -> str | None:
        """The ROS master of which the robot is a node, if it is."""
        return None if self._ros is None else self._ros.ros_master

    @property
    def backdoor_port(self) -> int | None:
        """Port of the backdoor, if it has one."""
        return None if self._backdoor_http is None else self._backdoor_http.address[1]

    @property
    def _runs(self) -> bool:
        return any(server.listening for server in self._servers.values())

    def _acceptors(self) -> list[Acceptor]:
        return [server.acceptor for server in self._servers.values()]

    @property
    def _listeners(self) -> "list[TcpServer | StatusStream | RosSide | BackdoorHttp]":
        """Listeners in the order of opening: who has reached the robot's own port finds all others open."""
        others = [each for each in (self._status, self._ros, self._backdoor_http) if each is not None]
        return [*others, *self._servers.values()]

    def _watched(self) -> Stepped:
        """The robot for the clock; with nobody else in between where nobody watches."""
        others = [each for each in (self._status, self._ros) if each is not None]
        watchers = [*self._recordings.recorders, *others]
        return ObservedRobot(self._controller, watchers) if watchers else self._controller

    def _open_session(self, protocol: str, name: str) -> Session:
        return open_session(
            protocol, self._controller, self._log, name, self.dialogue, self.settings.strict, self._canned
        )

    def _recording(self, path: Path) -> Recorder:
        from importlib import metadata

        title = f"{self.cell.description.name}, recorded by iiwa-sim {metadata.version('iiwa-sim')}"
        return Recorder(path, self.dialogue, self.clock.tick_s, title, list(self._servers))

    def _wait_for(self, coroutine: Callable[[], Coroutine[Any, Any, T]]) -> T:
        """The result of a coroutine, or what it raises. Raises RuntimeError if there is no thread."""
        if self._thread is None:
            raise RuntimeError("only within `with Simulator(...)`; in a loop, await the methods of `clock`")
        return self._thread.wait_for(coroutine)

    def _called(self, function: Callable[[], T]) -> T:
        self.clock.catch_up()
        try:
            return function()
        finally:
            self.clock.commanded()

    def _leave(self, thread: LoopThread) -> None:
        async def leave() -> None:
            await self.__aexit__(None, None, None)

        blocked = False
        try:
            if not thread.elsewhere:  # a forked child that leaves would end its parent's robot
                thread.wait_for(leave, LEAVE_S)
        except TimeoutError:
            blocked = True
            raise
        finally:
            thread.close(wait=not blocked)
            self._thread = None

    def _in_hand(self) -> Controller:
        self.clock.look()
        return self._controller

    def _tick(self) -> int:
        """How many there have been by now."""
        self.clock.catch_up()
        return self._controller.tick


def _pace(clock: str | Pace) -> Pace:
    return clock if isinstance(clock, Pace) else pace(clock)
