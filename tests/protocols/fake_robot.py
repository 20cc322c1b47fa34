"""A robot that only records its commands, and a conversation with it."""

from collections.abc import Iterable
from types import SimpleNamespace

from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.endings import WhenEnded
from iiwa_sim.controller.errors import RobotErrors
from iiwa_sim.controller.io import Io
from iiwa_sim.controller.modes import Mode
from iiwa_sim.controller.requests import MoveRequest
from iiwa_sim.controller.state import RobotStatus
from iiwa_sim.frames import Frame
from iiwa_sim.protocols.protocols import open_session
from tests.journal import Journal


class FakeRobot:
    """Stand-in for the controller: it plans nothing, and accepts every move unless `breaks` is set."""

    status = staticmethod(lambda: RobotStatus(2, 0, 1, 1, 0, 0, 0))
    tool_frame = staticmethod(lambda: Frame(600.0, 0.0, 500.5, 3.0, -0.0, 1e-5))
    flange_frame = staticmethod(lambda: Frame(1.0, 2.0, 3.0, 0.4, 0.5, 0.6))
    goal_frame = staticmethod(lambda: Frame(600.0, 100.0, 500.5, 3.0, 0.0, 0.0))
    motions = SimpleNamespace(goal=(1.0, 0.5, -0.25, -1.0, 0.0, 0.25, 1.5))
    distance_to_goal_mm = staticmethod(lambda: 100.25)
    cartesian_force = staticmethod(lambda: (1.5, -2.5, 3.0, 0.0, 0.0, -0.125))
    joint_torque = staticmethod(lambda: (7.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.0))

    def __init__(self) -> None:
        self.moves: list[MoveRequest] = []
        self.stops = 0
        self.queue = 3
        self.tick = 0
        self.breaks: Exception | None = None
        self.moving = False
        self.mode = Mode.UNKNOWN
        self.io = Io()
        self.override = 1.0
        self.errors = RobotErrors()
        self.joints: tuple[float, ...] = (0.0, 0.5, -0.25, -1.0, 1e-12, -0.0, 1.5707963267948966)

    def move(self, request: MoveRequest, _when_ended: WhenEnded | None = None) -> int:
        if self.breaks is not None:
            raise self.breaks
        self.moves.append(request)
        return len(self.moves)

    @property
    def accepted(self) -> int:
        return len(self.moves)

    def stop(self) -> None:
        self.stops += 1


class Conversation:
    """A session of one client with a robot."""

    def __init__(
        self,
        robot: FakeRobot | Controller | None = None,
        journal: Journal | None = None,
        name: str = "client",
        strict: bool = False,
    ) -> None:
        self.robot = robot or FakeRobot()
        self.journal = journal or Journal()
        self.session = open_session("iiwa", self.robot, self.journal, name, strict=strict)

    def send(self, packets: Iterable[bytes]) -> list[str]:
        """Send packets; return all replies, line by line."""
        answered = b""
        for packet in packets:
            self.session.receive(packet)
            answered += self.receive()
        return replies(answered)

    def receive(self) -> bytes:
        answered = b""
        while self.session.waiting:
            answered += self.session.answer()
        return answered

    def ask(self, line: str) -> str:
        """Send a line; return its one reply."""
        (reply,) = self.send([line.encode() + b"\n"])
        return reply


def replies(answered: bytes) -> list[str]:
    """Return the lines of replies, whose ends are checked."""
    lines = answered.decode("ascii").split("\r\n")
    assert lines.pop() == "", "the last reply lacks its line end"
    assert not any("\r" in line or "\n" in line for line in lines)
    return lines
