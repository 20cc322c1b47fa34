"""The simulator put together: a cell with its robots, the clock that steps them and the servers that talk."""

import asyncio
import os
import sys
import threading
import traceback
from collections.abc import Callable, Coroutine, Sequence
from concurrent import futures
from contextlib import AsyncExitStack, ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TypeVar

from iiwa_sim import log
from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.camera import HEIGHT, WIDTH
from iiwa_sim.cell.cell import Cell, cells_of, shared_world
from iiwa_sim.clock.clock import Clock, Stepped
from iiwa_sim.clock.pace import pace
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.controller_group import ControllerGroup
from iiwa_sim.controller.state import Snapshot, snapshot
from iiwa_sim.dialogue import Dialogue, Direction
from iiwa_sim.log import SessionLog
from iiwa_sim.motion.joints import Joints
from iiwa_sim.options.model import SettingError, Settings, file_of
from iiwa_sim.options.sources import from_keywords
from iiwa_sim.protocols.faults import WireFaults
from iiwa_sim.protocols.ports import DEFAULT_PROTOCOL, IIWA
from iiwa_sim.protocols.protocols import check_axes, command_names, open_session
from iiwa_sim.protocols.session import Session
from iiwa_sim.protocols.status import StatusSession, status_line
from iiwa_sim.robot_events import RobotEvents
from iiwa_sim.server.budget import Budget
from iiwa_sim.server.status_stream import StatusStream
from iiwa_sim.server.tcp import Admission, TcpServer
from iiwa_sim.server.token import word_of
from iiwa_sim.wording import need_library

if TYPE_CHECKING:
    from iiwa_sim.backdoor.http import BackdoorHttp
    from iiwa_sim.recordings.recorder import Recorder
    from iiwa_sim.ros.side import RosSide
    from iiwa_sim.world.arm import Arm

LEAVE_S, END_S = 10.0, 2.0
"""Seconds that the thread has to leave the context before it counts as blocked, and then to end."""

__tracebackhide__ = True  # pytest shows the line of the test instead
T = TypeVar("T")


class LoopThread(threading.Thread):
    """An asyncio event loop in a thread, from its creation until `close`, or until the program ends."""

    def __init__(self) -> None:
        super().__init__(name="iiwa-sim", daemon=True)
        # A factory, so that the loop of the calling thread stays as it is.
        self._runner = asyncio.Runner(loop_factory=asyncio.new_event_loop)
        self._loop = self._runner.get_loop()
        self._lock, self._closed, self._process = threading.Lock(), False, os.getpid()
        self.start()

    def run(self) -> None:
        with self._runner:
            while True:
                with suppress(SystemExit):  # its caller gets it
                    self._loop.run_forever()
                    return

    def wait_for(self, function: Callable[[], Coroutine[Any, Any, T]], limit_s: float | None = None) -> T:
        """Run a coroutine in the loop, and return its result or raise its error.

        If the wait is interrupted, the coroutine is cancelled. Raises TimeoutError after `limit_s`, with the
        line that blocks the thread. Raises RuntimeError in this thread itself, which would wait for ever, in
        a forked process, and if the loop is closed or closes meanwhile.
        """
        if os.getpid() != self._process:
            raise RuntimeError("the loop runs in the process that this one was forked from")
        if threading.current_thread() is self:
            raise RuntimeError("the loop cannot wait for itself")
        with self._lock:
            if self._closed:
                raise RuntimeError("the loop is closed")
            answer = asyncio.run_coroutine_threadsafe(function(), self._loop)
        try:
            if not futures.wait([answer], limit_s).done:
                line = traceback.extract_stack(sys._current_frames().get(self.ident or 0))[-1]
                busy = f"{line.filename}:{line.lineno} in {line.name}: {line.line}"
                raise TimeoutError(f"the thread {self.name} is blocked by {busy}")
            if fault := answer.exception():  # `result` would add lines of concurrent.futures to it
                raise fault
            return answer.result()
        except futures.CancelledError:
            raise RuntimeError("the loop is closed") from None
        except KeyboardInterrupt:
            answer.cancel()
            raise

    def close(self) -> None:
        """Cancel the tasks of the loop, and end the thread; one that is blocked ends later."""
        with self._lock:
            self._closed = True  # before the loop stops: pending coroutines start, and are cancelled
            self._loop.call_soon_threadsafe(self._loop.stop)
        self.join(END_S)


class SimulatedRobot:
    """A robot of a `Simulator`, which has its methods, too, if it is the only one.

    Any thread may call the methods here. `controller` and `dialogue` belong to the robot's thread: reach them
    through `Simulator.call`.
    """

    def __init__(self, simulator: "Simulator", cell: Cell, arm: "Arm | None") -> None:
        settings, clock, on_bye = simulator.settings, simulator.clock, simulator.on_bye
        self._call, self._clock, self.cell = simulator.call, clock, cell
        self.name = cell.name
        """Its name in the cell; empty for a cell that names none."""
        self.log_name = " ".join(filter(None, (log.robot.get(), self.name)))  # that of a fleet comes first
        self.backdoor: Backdoor
        self.dialogue = Dialogue(self._time_s, command_names)
        """The dialogue in all protocols. It can be read from `dialogue.remember()` on."""
        self.events = RobotEvents(self.dialogue, self.log_name)
        self.stepped = controller = cell.controller(
            clock.tick_s, arm=arm, servo_timeout_s=settings.servo_timeout_s, on_event=self.events.report
        )
        """The controller, for the clock, which steps it."""
        if controller.handling is not None:
            controller.handling.arm.report = self.events.part
        self.log = SessionLog()
        self.faults = faults = WireFaults(partial(self.dialogue.event, mark=Direction.ON_WIRE))
        ports = cell.ports or settings.ports
        faults.canned.is_served = IIWA in ports
        admission = Admission(settings.exclusive)
        for protocol in ports:
            check_axes(protocol, cell.description)

        def session(protocol: str, name: str) -> Session:
            context = name, self.dialogue, settings.strict, faults.canned
            return open_session(protocol, controller, self.log, *context)

        self.servers = {
            protocol: TcpServer(
                open_session=partial(session, protocol),
                host=settings.host,
                port=port,
                admission=admission,
                budget=simulator.budget,
                on_answered=clock.commanded,
                on_good_bye=on_bye if on_bye and protocol == IIWA else lambda: None,
                faults=faults,
            )
            for protocol, port in ports.items()
        }

    @property
    def controller(self) -> Controller:
        """The robot's controller. Get it anew for each use: a robot at rest does not tick until then."""
        self._call(self._clock.look)
        return self.stepped

    @property
    def joints(self) -> Joints:
        """Joint positions (rad)."""
        return self._call(lambda: self.stepped.joints)

    def state(self) -> Snapshot:
        """Return the whole state of the robot, of one tick; the last one after the context has ended."""
        return self._call(lambda: snapshot(self.stepped))

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
        self._call(lambda: self.faults.canned.set(command, reply, times))

    @property
    def host(self) -> str:
        """Address listened on."""
        return next(iter(self.servers.values())).acceptor.address[0]

    @property
    def port(self) -> int:
        """Port listened on, that of the first protocol."""
        return next(iter(self.ports.values()))

    @property
    def ports(self) -> dict[str, int]:
        """Port of each protocol, in the order in which they were named."""
        return {name: server.acceptor.address[1] for name, server in self.servers.items()}

    def _time_s(self) -> float:
        self._clock.catch_up()
        return self.stepped.tick * self._clock.tick_s


OnlyRobot = SimulatedRobot
if not TYPE_CHECKING:
    OnlyRobot = object  # `Simulator.__getattr__` forwards to the robot


class Simulator(OnlyRobot):
    """Simulated robot, or several in one cell, that listen on their ports while its context is open.

    `with Simulator(clock="fast") as robot:` runs it in a thread of its own, `async with` in the caller's
    asyncio loop. A driver connects to `robot.host` and `robot.port`, free ports unless options name them. A
    single robot lends its methods to its simulator; of several in a cell, `robots["left"]` has them.

    Any thread may call the methods here. `controller`, `clock` and `dialogue` belong to the robot's thread:
    reach them through `call`. In a loop, await the methods of `clock`: those here that let time pass raise
    RuntimeError.

    Args:
        robot: Name of a built-in robot, a robot's folder, or the path of a cell.toml.
        cell: Path of a cell.toml, or a loaded cell: one `Cell`, or one for each robot.
        settings: Options, such as `Settings(clock="fast")`; keywords precede them.
        on_bye: Called after the reply to a `bye`; the caller may leave the context there.
        options: Options by the names of `Settings`, such as `clock="fast"`.

    Raises:
        SettingError: An option is unknown, has a wrong value, or does not fit to another or the cell.
        Unusable: Cell or robot cannot be used (CellFault, RobotFault), or a library is not installed.

    Entering the context raises Unusable for an address or a file that cannot be used.
    """

    def __init__(
        self,
        robot: str | Path | None = None,
        *,
        cell: str | Path | Cell | Sequence[Cell] | None = None,
        settings: Settings | None = None,
        on_bye: Callable[[], None] | None = None,
        **options: Any,
    ) -> None:
        known = (cell,) if isinstance(cell, Cell) else None if isinstance(cell, str | Path) else cell
        named = {"robot": robot, "cell": None if known else cell}
        self.settings = settings = from_keywords(named | options, settings)
        self._thread: LoopThread | None = None
        self.cells = tuple(known or cells_of(settings.robot, settings.cell))
        """The cell, once for each robot."""
        path = self.cells[0].path
        if self.cells[0].ports and (settings.port != (0,) or settings.protocol != (DEFAULT_PROTOCOL,)):
            raise SettingError(f"--port, --protocol: expected none: {path} has those of each robot")
        has_ros = settings.rosbridge_port is not None or settings.ros or settings.ros2
        if len(self.cells) > 1 and has_ros:
            raise SettingError(f"--rosbridge-port, --ros, --ros2: expected none: {path} has several robots")
        self.clock = Clock(settings.rate_hz, pace(settings.clock))
        self._recorders: list[Recorder] = []
        self._recordings = ExitStack()
        self.budget, self.on_bye = Budget(self.clock.catch_up), on_bye
        world = shared_world(self.cells, self.clock.tick_s)
        arms = [None] if world is None else world.arms
        pairs = zip(self.cells, arms, strict=True)
        self.robots = {each.name: SimulatedRobot(self, each, arm) for each, arm in pairs}
        """The robots by their names; a cell without `[[robot]]` has one, whose name is empty."""
        robots = list(self.robots.values())
        self._group = ControllerGroup([each.stepped for each in robots], world)
        states: dict[str, list[Callable[[], None]]] = {}
        for each in robots:
            own = each.stepped, each.faults, each.servers.values()
            each.backdoor = Backdoor(*own, self.clock, each.dialogue, self.call, self._group, states)
        first = robots[0]
        self._opened: AsyncExitStack | None = None
        self._backdoor_http: BackdoorHttp | None = None
        if settings.backdoor_port is not None or settings.view_port is not None:  # the page is its client
            from iiwa_sim.backdoor import http

            for each in robots:
                each.dialogue.remember()
            token = word_of(settings.backdoor_token, settings.backdoor_token_file)
            backdoors = {name: each.backdoor for name, each in self.robots.items()}
            host, port = settings.backdoor_host, settings.backdoor_port or 0
            self._backdoor_http = http.BackdoorHttp(backdoors, host, port, token)
        self._status: StatusStream | None = None
        if settings.status_port is not None:
            self._status = StatusStream(
                line=lambda: b"".join(status_line(each.stepped, name) for name, each in self.robots.items()),
                open_session=lambda name: StatusSession(self._group.controllers, first.log, name),
                host=settings.host,
                port=settings.status_port,
                rate_hz=settings.status_rate_hz,
                tick_rate_hz=settings.rate_hz,
                on_answered=lambda _: self.clock.look(),
                budget=self.budget,
            )
        self.ros: RosSide | None = None
        if has_ros:
            from iiwa_sim.ros import side

            self.ros = side.RosSide(first.stepped, first.log, settings, self.clock)

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            robots = self.__dict__.get("robots", {})
            if len(robots) == 1:
                return getattr(next(iter(robots.values())), name)
            hint = f"a simulator of {len(robots)} robots has none; robots[NAME] has what belongs to one"
            raise AttributeError(f"{name!r}: {hint}", name=name, obj=self)

    async def __aenter__(self) -> Self:
        if self._opened is not None:
            raise RuntimeError("the simulator runs already")
        async with AsyncExitStack() as opened:
            if self.settings.transcript is not None:
                from iiwa_sim.transcript.record import recorded

                for robot in self.robots.values():
                    file = Path(file_of(robot.name, self.settings.transcript))
                    title = f"{robot.cell.description.name}, recorded by iiwa-sim"
                    opened.enter_context(recorded(file, robot.dialogue, title, list(robot.servers)))
            opened.callback(self._recordings.close)
            if self.settings.record is not None:
                self.record(self.settings.record, self.settings.record_rate_hz)
            opened.callback(self.clock.stop)
            ros = () if self.ros is None else self.ros.transports
            for server in (self._status, *ros, self._backdoor_http):
                if server is not None:  # open before clients reach the robots' own ports
                    opened.push_async_callback(server.close)
                    await server.start()
            for robot in self.robots.values():
                with log.named(robot.log_name):
                    for port in robot.servers.values():
                        await port.start()
                        opened.push_async_callback(port.close)
            self._opened = opened.pop_all()
        self.clock.start(self._watched())
        return self

    async def __aexit__(self, *_: object) -> None:
        self._group.stop()  # or the log would say that the clients have vanished
        opened, self._opened = self._opened, None
        if opened is not None:
            await opened.aclose()

    def __enter__(self) -> Self:
        if self._thread is not None or self._opened is not None:
            raise RuntimeError("the simulator runs already")
        self._thread = LoopThread()
        try:
            return self._thread.wait_for(self.__aenter__)
        except BaseException:
            self.__exit__()
            raise

    def __exit__(self, *_: object) -> None:
        if self._thread is not None:
            try:
                self._thread.wait_for(self.__aexit__, LEAVE_S)
            finally:
                self._thread.close()
                self._thread = None

    def call(self, function: Callable[[], T], limit_s: float | None = None) -> T:
        """Call `function` between two ticks in the robot's thread, and return its result or raise its error.

        Raises TimeoutError after `limit_s`, with the line that blocks the thread. If the thread has ended, or
        there is none, the function is called at once.
        """

        def called() -> T:
            self.clock.catch_up()
            try:
                return function()
            finally:
                self.clock.commanded()

        async def awaited() -> T:
            return called()

        if self._thread is None or threading.current_thread() is self._thread:
            return called()
        return self._thread.wait_for(awaited, limit_s)

    def advance(self, seconds: float) -> None:
        """Let simulated time (s, 0 to a day) pass as fast as possible, with any clock; raises ValueError.

        A part of a tick counts as a whole one.
        """
        self._wait_for(lambda: self.clock.advance(seconds))

    def camera(self, name: str, width: int = WIDTH, height: int = HEIGHT) -> bytes:
        """Return what a camera of the cell's scene sees, as PNG of so many pixels. Raises Refused."""
        return self._wait_for(lambda: next(iter(self.robots.values())).backdoor.camera(name, width, height))

    def run_until_stopped(self, limit_s: float = 60.0) -> float:
        """Let time pass until the robot has stopped, and return the simulated seconds that have passed.

        Raises StillMoving, a TimeoutError, if it still moves after `limit_s` (simulated, 0 to a day).
        """
        return self._wait_for(lambda: self.clock.run_until_stopped(limit_s))

    def pause(self) -> None:
        """Suspend simulated time until `resume`, except for `advance` and `run_until_stopped`."""
        self.call(self.clock.pause)

    def resume(self) -> None:
        """Resume simulated time."""
        self.call(self.clock.resume)

    def set_clock(self, clock: str) -> None:
        """Set the clock: "real", "10x", "fast" or "stepped". Raises ValueError for others."""
        self.call(lambda: self.clock.set_pace(pace(clock)))

    def record(self, path: str | Path, rate_hz: int | None = None) -> ExitStack:
        """Record all robots from now on into an MCAP file, which is overwritten: see docs/recordings.md.

        Args:
            path: The file.
            rate_hz: States per simulated second, 1 to the tick rate; every tick if None.

        Returns:
            The recording: it ends with its context, by `close`, or with the simulator.

        Raises:
            Unusable: The file cannot be written (RecordingFault), or mcap is not installed.
            ValueError: The rate is out of range.
        """
        need_library("mcap", "record")
        from iiwa_sim.recordings.recorder import Source, recorders_into

        robots, most_hz = self.robots.values(), self.clock.rate_hz
        if rate_hz is not None and not 1 <= rate_hz <= most_hz:
            raise ValueError(f"record_rate_hz is {rate_hz}, expected 1 to {most_hz}, that of the ticks")
        sources = [Source(each.cell, each.stepped, each.dialogue, each.log, each.events) for each in robots]
        recorders = recorders_into(Path(path), sources, self.clock, rate_hz or most_hz)

        def start() -> None:
            self._recorders += recorders
            self.clock.drive(self._watched())  # the robots do not rest from here on
            for each in recorders:
                each.start()

        def stop() -> None:
            for each in recorders:
                each.stop()
                self._recorders.remove(each)
            self.clock.drive(self._watched())

        self.call(start)
        recording = ExitStack()
        recording.callback(recorders[0].out.close)
        recording.callback(self.call, stop)  # which comes first
        self._recordings.callback(recording.close)
        return recording

    @property
    def host(self) -> str:
        """Address listened on."""
        return next(iter(self.robots.values())).host

    @property
    def status_port(self) -> int | None:
        """Port of the status stream, if there is one."""
        return None if self._status is None else self._status.acceptor.address[1]

    @property
    def rosbridge_port(self) -> int | None:
        """Port of rosbridge, if there is one."""
        rosbridge = None if self.ros is None else self.ros.rosbridge
        return None if rosbridge is None else rosbridge.address[1]

    @property
    def backdoor_port(self) -> int | None:
        """Port of the backdoor over HTTP, if there is one."""
        return None if self._backdoor_http is None else self._backdoor_http.acceptor.address[1]

    def _watched(self) -> Stepped:
        """Return the object that the clock steps: one robot itself if there are no observers."""
        others = [each for each in (self._status, self.ros) if each is not None]
        self._group.observers = observers = [*self._recorders, *others]
        return self._group if observers or len(self.robots) > 1 else self._group.controllers[0]

    def _wait_for(self, coroutine: Callable[[], Coroutine[Any, Any, T]]) -> T:
        """Return the result of a coroutine, or raise its error. Raises RuntimeError if there is no thread."""
        if self._thread is None:
            raise RuntimeError("only within `with Simulator(...)`; in a loop, await the methods of `clock`")
        return self._thread.wait_for(coroutine)
