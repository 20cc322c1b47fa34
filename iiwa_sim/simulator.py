"""The simulator put together: a cell with its robots, the clock that steps them and the servers that talk."""

import logging
from collections.abc import Callable, Coroutine, Sequence
from contextlib import AbstractContextManager, AsyncExitStack, ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TypeVar

from iiwa_sim import log
from iiwa_sim.backdoor.states import States
from iiwa_sim.camera import HEIGHT, WIDTH
from iiwa_sim.cell.cell import Cell, cells_of, shared_world
from iiwa_sim.clock.clock import Clock, Stepped
from iiwa_sim.clock.pace import pace
from iiwa_sim.controller.controller_group import ControllerGroup
from iiwa_sim.loop_thread import LoopThread
from iiwa_sim.options.model import SettingError, Settings
from iiwa_sim.options.sources import from_keywords
from iiwa_sim.protocols.ports import DEFAULT_PROTOCOL
from iiwa_sim.protocols.status import StatusSession, status_line
from iiwa_sim.recordings.recordings import Recordings, Source
from iiwa_sim.server.budget import Budget
from iiwa_sim.server.status_stream import StatusStream
from iiwa_sim.server.token import Token, word_of
from iiwa_sim.simulated_robot import SimulatedRobot

if TYPE_CHECKING:
    from iiwa_sim.backdoor.http import BackdoorHttp
    from iiwa_sim.ros.side import RosSide

    OnlyRobot = SimulatedRobot
else:
    OnlyRobot = object  # `Simulator.__getattr__` forwards to the robot

LEAVE_S = 10.0
"""Seconds that the thread has to leave the context before it counts as blocked."""

T = TypeVar("T")
logger = logging.getLogger(__name__)


class Simulator(OnlyRobot):
    """Simulated robot, or several in one cell, that listen on their ports while its context is open.

    `with Simulator(clock="fast") as robot:` runs it in a thread of its own, `async with` in the caller's
    asyncio loop. A driver connects to `robot.host` and `robot.port`, free ports unless options name them. A
    single robot lends its methods to its simulator; of several in a cell, `robots["left"]` has them.

    With a thread, any other thread may call the methods here; each returns when it is done. `controller`,
    `clock` and `dialogue` belong to the robot's thread: reach them through `call`. In a loop, methods that
    let time pass raise RuntimeError: await those of `clock`.

    Args:
        robot: Name of a built-in robot, a robot's folder, or the path of a cell.toml.
        cell: Path of a cell.toml, or a loaded cell: one `Cell`, or one for each robot.
        settings: Options, such as `Settings(clock="fast")`; keywords precede them.
        on_bye: Called after the reply to a `bye`; the caller may leave the context there.
        options: Options by the names of `Settings`, such as `clock="fast"`.

    Raises:
        SettingError: An option is unknown, has a wrong value, or does not fit to another or the cell.
        CellFault, RobotFault: Cell or robot cannot be used, or has not the axes for a protocol.
        RosFault: The library for rosbridge or rospy is not installed.

    Entering the context raises ListenFault if host and ports cannot be listened on, RosFault if there can be
    no node, and TranscriptFault or RecordingFault for a file that cannot be written.
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
        if self.cells[0].ports and (settings.port != (0,) or settings.protocol != (DEFAULT_PROTOCOL,)):
            names = " and ".join(each.name for each in self.cells)
            raise SettingError(f"--port, --protocol: expected none: write those of {names} in the cell")
        has_ros = settings.rosbridge_port is not None or settings.ros or settings.ros2
        if len(self.cells) > 1 and has_ros:
            raise SettingError(
                f"--rosbridge-port, --ros, --ros2: expected none, with several robots in {self.cells[0].path}"
            )
        self.clock = Clock(settings.rate_hz, pace(settings.clock))
        budget = Budget(self.clock.catch_up)
        world = shared_world(self.cells, self.clock.tick_s)
        arms = [None] if world is None else world.arms
        self.robots = {
            each.name: SimulatedRobot(each, arm, settings, self.clock, self.call, budget, on_bye)
            for each, arm in zip(self.cells, arms, strict=True)
        }
        """The robots by their names; a cell without `[[robot]]` has one, whose name is empty."""
        robots = list(self.robots.values())
        self._group = ControllerGroup([each.stepped for each in robots], world)
        self._recordings = Recordings(self.clock, lambda: self.clock.drive(self._watched()))
        states = States(*self._group.controllers)
        for each in robots:
            each.join(self._group, states, self._recordings)
        first = robots[0]
        self._opened, self._is_open = AsyncExitStack(), False
        self._backdoor_http: BackdoorHttp | None = None
        if settings.backdoor_port is not None:
            from iiwa_sim.backdoor import http

            for each in robots:
                each.dialogue.remember()
            word = word_of(settings.backdoor_token, settings.backdoor_token_file)
            token = None if word is None else Token(word)
            backdoors = {name: each.backdoor for name, each in self.robots.items()}
            self._backdoor_http = http.BackdoorHttp(
                backdoors, first.log, settings.backdoor_host, settings.backdoor_port, token
            )
        self._status: StatusStream | None = None
        if settings.status_port is not None:
            self._status = StatusStream(
                line=lambda: b"".join(status_line(each.stepped, name) for name, each in self.robots.items()),
                open_session=lambda name: StatusSession(self._group.controllers, first.log, name),
                host=settings.host,
                port=settings.status_port,
                rate_hz=settings.status_rate_hz,
                tick_rate_hz=settings.rate_hz,
                on_client=self.clock.look,
                budget=budget,
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
        if self._is_open:
            raise RuntimeError("the simulator runs already")
        async with AsyncExitStack() as opened:
            if self.settings.transcript is not None:
                path = Path(self.settings.transcript)
                for robot in self.robots.values():
                    own = path.with_stem(f"{path.stem}-{robot.name}") if len(self.robots) > 1 else path
                    opened.enter_context(self._transcript(own, robot))
            opened.callback(self._recordings.end_all)
            if self.settings.record is not None:
                record = Path(self.settings.record), self.settings.record_rate_hz
                self._recordings.begin(*record, self._sources)
            opened.callback(self.clock.stop)
            for server in (self._status, self.ros, self._backdoor_http):
                if server is not None:  # who has reached the robots' own ports finds these open
                    await server.start()
                    opened.push_async_callback(server.close)
            for robot in self.robots.values():
                with log.named(robot.log_name):
                    for port in robot.servers.values():
                        await port.start()
                        opened.push_async_callback(port.close)
            self._opened = opened.pop_all()
        self._is_open = True
        self.clock.start(self._watched())
        return self

    async def __aexit__(self, *_: object) -> None:
        self._group.stop()  # or the log would say that the clients have vanished
        self._is_open = False
        await self._opened.aclose()

    def __enter__(self) -> Self:
        if self._thread is not None:
            raise RuntimeError("the simulator runs already")
        self._thread = LoopThread("iiwa-sim")
        try:
            return self._thread.wait_for(self.__aenter__)
        except BaseException:
            self.__exit__()
            raise

    def __exit__(self, *_: object) -> None:
        thread, wait = self._thread, True
        if thread is None:
            return
        try:
            thread.wait_for(self.__aexit__, LEAVE_S)
        except TimeoutError:
            wait = False
            raise
        finally:
            thread.close(wait=wait)
            self._thread = None

    def call(self, function: Callable[[], T], limit_s: float | None = None) -> T:
        """The result of `function`, called between two ticks in the robot's thread; raises what it raises.

        Raises TimeoutError, naming what blocks the thread, if that takes more than `limit_s`. If the thread
        has ended, or there is none, the function is called at once.
        """

        def called() -> T:
            self.clock.catch_up()
            try:
                return function()
            finally:
                self.clock.commanded()

        async def awaited() -> T:
            return called()

        if self._thread is None or self._thread.current:
            return called()
        return self._thread.wait_for(awaited, limit_s)

    def advance(self, seconds: float) -> None:
        """Let simulated time pass as fast as possible, with any clock.

        Args:
            seconds: Simulated time, 0 to a day; part of a tick counts as a whole one.

        Raises:
            ValueError: The time is out of range.
        """
        self._wait_for(lambda: self.clock.advance(seconds))

    def camera(self, name: str, width: int = WIDTH, height: int = HEIGHT) -> bytes:
        """Return what a camera of the cell's scene sees, as PNG of so many pixels.

        Raises:
            Refused: The scene has no such camera, or the machine cannot render.
        """
        return self._wait_for(lambda: next(iter(self.robots.values())).backdoor.camera(name, width, height))

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

    def set_clock(self, clock: str) -> None:
        """Set the clock: "real", "10x", "fast" or "stepped". Raises ValueError for others."""
        wanted = pace(clock)
        self.call(lambda: self.clock.set_pace(wanted))

    def record(self, path: str | Path, rate_hz: int | None = None) -> ExitStack:
        """Record all robots from now on into one file, as `SimulatedRobot.record` does for one."""
        return self._recordings.begin(Path(path), rate_hz, self._sources, self.call)

    @property
    def host(self) -> str:
        """Address listened on."""
        return next(iter(self.robots.values())).host

    @property
    def status_port(self) -> int | None:
        """Port on which the state is broadcast, if it is."""
        return None if self._status is None else self._status.acceptor.address[1]

    @property
    def rosbridge_port(self) -> int | None:
        """Port on which the robot is on ROS by rosbridge, if it is."""
        rosbridge = None if self.ros is None else self.ros.rosbridge
        return None if rosbridge is None else rosbridge.address[1]

    @property
    def backdoor_port(self) -> int | None:
        """Port of the backdoor, if it has one."""
        return None if self._backdoor_http is None else self._backdoor_http.acceptor.address[1]

    @property
    def _sources(self) -> list[Source]:
        return [each.source for each in self.robots.values()]

    def _watched(self) -> Stepped:
        """The robots for the clock; with nobody else in between where nobody watches."""
        others = [each for each in (self._status, self.ros) if each is not None]
        self._group.observers = observers = [*self._recordings.recorders, *others]
        return self._group if observers or len(self.robots) > 1 else self._group.controllers[0]

    def _transcript(self, path: Path, robot: SimulatedRobot) -> AbstractContextManager[None]:
        from importlib import metadata

        from iiwa_sim.transcript.record import recorded

        title = f"{robot.cell.description.name}, recorded by iiwa-sim {metadata.version('iiwa-sim')}"
        return recorded(path, robot.dialogue, self.clock.tick_s, title, list(robot.servers))

    def _wait_for(self, coroutine: Callable[[], Coroutine[Any, Any, T]]) -> T:
        """The result of a coroutine, or what it raises. Raises RuntimeError if there is no thread."""
        if self._thread is None:
            raise RuntimeError("only within `with Simulator(...)`; in a loop, await the methods of `clock`")
        return self._thread.wait_for(coroutine)
