"""One robot of a simulator: its controller, what clients say to it, and its ports."""

import logging
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from iiwa_sim import log
from iiwa_sim.backdoor.backdoor import Backdoor, Call
from iiwa_sim.backdoor.states import States
from iiwa_sim.cell.cell import Cell
from iiwa_sim.clock.clock import Clock
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.controller_group import ControllerGroup
from iiwa_sim.controller.state import Snapshot, snapshot
from iiwa_sim.dialogue import Dialogue
from iiwa_sim.log import SessionLog
from iiwa_sim.motion.joints import Joints
from iiwa_sim.options.model import Settings
from iiwa_sim.protocols.faults import WireFaults
from iiwa_sim.protocols.ports import IIWA
from iiwa_sim.protocols.protocols import check_axes, command_names, open_session
from iiwa_sim.protocols.session import Session
from iiwa_sim.recordings.recordings import Recordings, Source
from iiwa_sim.robot.model import differing_limits
from iiwa_sim.robot_events import RobotEvents
from iiwa_sim.server.budget import Budget
from iiwa_sim.server.tcp import Admission, TcpServer

if TYPE_CHECKING:
    from iiwa_sim.world.arm import Arm

T = TypeVar("T")
logger = logging.getLogger(__name__)


class SimulatedRobot:
    """A robot of a `Simulator`, which has its methods, too, if it is the only one.

    Any thread may call the methods here. `controller` and `dialogue` belong to the robot's thread: reach them
    through `Simulator.call`.
    """

    def __init__(
        self,
        cell: Cell,
        arm: "Arm | None",
        settings: Settings,
        clock: Clock,
        call: Call,
        budget: Budget,
        on_bye: Callable[[], None] | None,
    ) -> None:
        self.cell = cell
        self.name = cell.name
        """Its name in the cell; empty for a cell that names none."""
        self.log_name = " ".join(filter(None, (log.robot.get(), self.name)))  # that of a fleet comes first
        with log.named(self.log_name):
            for line in differing_limits(cell.description):
                logger.warning("%s", line)
        self._clock, self._call, self._strict = clock, call, settings.strict
        self.dialogue = Dialogue(self._tick, clock.tick_s, command_names)
        """The dialogue in all protocols. It can be asked for from `dialogue.remember()` on."""
        self._events = RobotEvents(self.dialogue, self.log_name)
        self.stepped = controller = cell.controller(
            clock.tick_s,
            arm=arm,
            servo_timeout_s=settings.servo_timeout_s,
            on_event=self._events.tell,
        )
        """The controller, for who steps it."""
        if controller.handling is not None:
            controller.handling.arm.tell = self._events.part
        self.log = SessionLog()
        self.faults = faults = WireFaults(self.dialogue.on_wire)
        ports = cell.ports or settings.ports
        faults.canned.heard = IIWA in ports
        admission = Admission(settings.exclusive, settings.reconnect_pause_s)
        for protocol in ports:
            check_axes(protocol, cell.description)
        self.servers = {
            protocol: TcpServer(
                open_session=partial(self._open_session, protocol),
                host=settings.host,
                port=port,
                admission=admission,
                budget=budget,
                on_answered=clock.commanded,
                on_good_bye=on_bye if on_bye and protocol == IIWA else lambda: None,
                faults=faults,
                protocol=protocol,
            )
            for protocol, port in ports.items()
        }

    def join(self, group: ControllerGroup, states: States, recordings: Recordings) -> None:
        """Let the robot share a cell with others."""
        self.backdoor = Backdoor(
            self.stepped,
            self.faults,
            self.servers.values(),
            self._clock,
            self.dialogue,
            self._call,
            group,
            states,
        )
        self._recordings = recordings

    @property
    def source(self) -> Source:
        """The robot as recordings see it."""
        return Source(self.cell, self.stepped, self.dialogue, self.backdoor, self.log, self._events)

    @property
    def controller(self) -> Controller:
        """The robot's controller, as of now.

        To be had anew whenever something is asked of it or begun: a robot at rest does not tick until then.
        """
        return self._call(self._in_hand)

    @property
    def joints(self) -> Joints:
        """Joint positions (rad)."""
        return self._call(lambda: self.stepped.joints)

    def state(self) -> Snapshot:
        """The whole state of the robot, of one tick; the last one after the context has ended."""
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

    def record(self, path: str | Path, rate_hz: int | None = None) -> ExitStack:
        """Record the robot from now on into a file, which is overwritten: see docs/recordings.md.

        Args:
            path: MCAP file.
            rate_hz: States per simulated second, 1 to the tick rate; every tick if None.

        Returns:
            The recording: it ends with its context, by `close`, or with the simulator.

        Raises:
            RecordingFault: The file cannot be written, or mcap is not installed.
            ValueError: The rate is out of range.
        """
        return self._recordings.begin(Path(path), rate_hz, [self.source], self._call)

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

    def _open_session(self, protocol: str, name: str) -> Session:
        canned = self.faults.canned
        return open_session(protocol, self.stepped, self.log, name, self.dialogue, self._strict, canned)

    def _in_hand(self) -> Controller:
        self._clock.look()
        return self.stepped

    def _tick(self) -> int:
        """How many there have been by now."""
        self._clock.catch_up()
        return self.stepped.tick
