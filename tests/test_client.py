import contextlib
import inspect
import math
import socket
import threading
from collections.abc import Callable, Iterator

import pytest

from iiwa_sim.client import (
    CommandError,
    Frame,
    Iiwa,
    JointPosition,
    LastError,
    Reachability,
    ReplyError,
    RobotStatus,
    UnknownCommandError,
)
from iiwa_sim.controller.errors import Refused
from iiwa_sim.dialect.table import load_table
from tests.dialect.fake_robot import FakeRobot, Journal, Session

TABLE = load_table("iiwa")
FRAME = (600.0, -0.5, 500.0, 3.0, 0.25, -3.0)
JOINTS = (0.0, 0.5, -0.25, -1.0, 0.0, 0.0, 1.5)
SPEEDS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 1.0)

# Arguments that stand for several values of the table.
PARTS = {
    "target": ("x", "y", "z", "alpha", "beta", "gamma"),
    "joints": tuple(f"j{i}" for i in range(7)),
    "speeds": tuple(f"v{i}" for i in range(7)),
    "position": ("x", "y", "z"),
    "quaternion": ("qx", "qy", "qz", "qw"),
    "shift": ("dx", "dy", "dz", "dalpha", "dbeta", "dgamma"),
    "force": ("fx", "fy", "fz", "tx", "ty", "tz"),
}

PROSE = {"get error": LastError, "is reachable": Reachability, "is lin reachable": Reachability}

Answer = Callable[[bytes], bytes]


class Peer:
    """One connection's other end: `answer` turns what it hears into what it says; b"" ends the connection."""

    def __init__(self, answer: Answer) -> None:
        self.heard = b""
        self._answer = answer
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        connection, _ = self._listener.accept()
        with connection, contextlib.suppress(ConnectionError):
            while data := connection.recv(65536):
                self.heard += data
                reply = self._answer(data)
                if not reply:
                    return
                connection.sendall(reply)

    def close(self) -> None:
        """Once the client is closed."""
        self._thread.join(10)
        assert not self._thread.is_alive()
        self._listener.close()


@pytest.fixture
def connect() -> Iterator[Callable[[Answer], tuple[Iiwa, Peer]]]:
    opened: list[tuple[Iiwa, Peer]] = []

    def connect(answer: Answer) -> tuple[Iiwa, Peer]:
        peer = Peer(answer)
        opened.append((Iiwa("127.0.0.1", peer.port, timeout_s=10), peer))
        return opened[-1]

    yield connect
    for client, peer in opened:
        client.close()
        peer.close()


def speaking_for(robot: FakeRobot) -> Answer:
    """Our own dialect as the other end."""
    session = Session(robot, Journal(), "client")

    def answer(data: bytes) -> bytes:
        session.receive(data)
        answered = b""
        while session.waiting or not answered:
            answered += session.answer()
        return answered

    return answer


def assert_closed(client: Iiwa) -> None:
    for call in (client.hello, client.get_joint_position, client.help, client.bye):
        with pytest.raises(ConnectionError, match="this connection is closed"):
            call()
    client.close()


def always(reply: bytes) -> Answer:
    return lambda _: reply


@pytest.mark.parametrize("name", TABLE.commands)
def test_a_method_for_every_command_with_the_tables_parameters(name):
    command = TABLE.commands[name]
    method = getattr(Iiwa, name.replace(" ", "_"))
    arguments = list(inspect.signature(method).parameters)[1:]
    values = [value for argument in arguments for value in PARTS.get(argument, (argument,))]
    known = [each.name for each in (*command.parameters, *command.optional)]
    assert values == ([command.phrase] if command.phrase else known)
    result = inspect.get_annotations(method)["return"]
    if name == "get queue":
        assert result is int
    elif command.reply_list is not None:
        assert result == tuple[bool, ...]
    elif len(command.reply_values) == 1:
        assert result is (bool if command.reply_values[0].integer else float)
    elif command.reply_values:
        assert result._fields == tuple(each.name for each in command.reply_values)
    else:
        words = str if command.phrase or len(command.reply_words) > 1 else None
        assert result is PROSE.get(name, words)


def test_no_method_that_the_table_does_not_know():
    methods = {name for name, _ in inspect.getmembers(Iiwa, inspect.isfunction) if not name.startswith("_")}
    assert methods - {name.replace(" ", "_") for name in TABLE.commands} == {"close", "wait_until_stopped"}


@pytest.mark.requirement("FRA005")
def test_moves_arrive_as_they_were_called(connect):
    robot = FakeRobot()
    client, _ = connect(speaking_for(robot))
    client.hello()
    client.lin_move(FRAME, speed=0.5, blending=0)
    client.ptp_move(Frame(*FRAME), 1e-5, 10)
    client.linr_move(FRAME, 0.5, 0, r=1.25)
    client.ptpr_move(FRAME, 0.5, 0, -1.25)
    client.joint_move(JOINTS, speeds=SPEEDS)
    client.ptp_quaternion_move(FRAME[:3], (0, 0, 1, 0), 0.5, 0)
    client.lin_tool_relative_move(FRAME, 0.5, 5)
    client.stop()
    assert robot.moves == [
        ("lin", FRAME, 0.5, 0.0, None),
        ("ptp", FRAME, 1e-5, 10.0, None),
        ("lin", FRAME, 0.5, 0.0, 1.25),
        ("ptp", FRAME, 0.5, 0.0, -1.25),
        ("joint", JOINTS, SPEEDS),
        ("ptp", (*FRAME[:3], math.pi, 0.0, 0.0), 0.5, 0.0, None),
        ("lin relative", FRAME, 0.5, 5.0, True),
    ]
    assert robot.stops == 1


def test_whether_a_target_is_reachable_is_read_with_the_reason(connect):
    robot = FakeRobot()
    client, _ = connect(speaking_for(robot))
    assert client.is_reachable(FRAME) == Reachability(True, 0, "")
    assert client.is_lin_reachable(FRAME, r=0.5) == Reachability(True, 0, "")
    robot.refuses = Refused(3021, "out of reach")
    assert client.is_lin_reachable(FRAME) == Reachability(False, 3021, "out of reach")
    assert client.get_error().code == 0


@pytest.mark.parametrize("reply", [b"unreachable\r\n", b"perhaps 3021 it is\r\n"])
def test_a_reachability_that_makes_no_sense_ends_the_connection(connect, reply):
    client, _ = connect(always(reply))
    with pytest.raises(ReplyError, match="is reachable"):
        client.is_reachable(FRAME)
    assert_closed(client)


@pytest.mark.requirement("FRA007", "FRC017", "FRC018")
def test_status_is_read_into_named_values(connect):
    client, _ = connect(speaking_for(FakeRobot()))
    assert client.get_status() == "stopped"
    assert client.get_mode() == "unknown"
    assert client.get_queue() == 3
    assert client.get_error() == LastError(0, "none")
    assert client.get_tool_frame() == Frame(600.0, 0.0, 500.5, 3.0, 0.0, 1e-5)
    assert client.get_flange_frame().gamma == 0.6
    assert client.get_cartesian_force().fy == -2.5
    assert client.get_joint_torque().t0 == 7.0
    assert client.get_joint_position() == JointPosition(0.0, 0.5, -0.25, -1.0, 0.0, 0.0, 1.570796327)
    assert client.get_robot_status() == RobotStatus(2, 0, 1, 1, 0, 0, 0)
    assert client.get_goal_frame() == Frame(600.0, 100.0, 500.5, 3.0, 0.0, 0.0)
    assert client.get_goal_joint_position().j0 == 1.0
    assert client.get_distance_to_goal() == 100.25
    client.set_override(0.25)
    assert client.get_override() == 0.25
    client.set_output(2, True)
    assert client.get_outputs() == (False, True, *[False] * 14)
    assert client.get_output(2) is True
    assert client.get_input(2) is False
    assert client.get_inputs() == (False,) * 16
    with pytest.raises(CommandError):
        client.set_input(2, True)
    assert client.get_error().code == 2
    client.reset_error()
    assert client.get_error().code == 0
    assert "lin move : x[mm]" in client.help("lin move")
    assert client.help("lin\nmove") == client.help("lin move")


@pytest.mark.requirement("FRC021")
def test_the_last_error_is_read_with_its_code(connect):
    client, _ = connect(speaking_for(FakeRobot()))
    with pytest.raises(CommandError):
        client.help("nonsense")
    assert client.get_error() == LastError(3040, "no such command")


def test_an_error_without_a_code_ends_the_connection(connect):
    client, _ = connect(always(b"none at all\r\n"))
    with pytest.raises(ReplyError, match="get error"):
        client.get_error()
    assert_closed(client)


def test_bye_ends_the_connection(connect):
    robot = FakeRobot()
    client, peer = connect(speaking_for(robot))
    client.bye()
    assert robot.stops == 1
    assert peer.heard == b"bye\r\n"
    assert_closed(client)


@pytest.mark.parametrize(
    "call",
    [
        lambda client: client.lin_move(FRAME[:5], 0.5, 0),
        lambda client: client.lin_move((*FRAME, 0.0), 0.5, 0),
        lambda client: client.joint_move(JOINTS, [0.5]),
        lambda client: client.lin_move(FRAME, math.nan, 0),
        lambda client: client.joint_move([math.inf] * 7, SPEEDS),
        lambda client: client.start_gravity(-math.inf),
    ],
)
def test_wrong_numbers_are_never_sent(connect, call):
    client, peer = connect(always(b"hello\r\n"))
    with pytest.raises(ValueError, match="expected"):
        call(client)
    client.hello()
    assert peer.heard == b"hello\r\n"


def test_error_and_unknown_command_are_raised_and_the_connection_lives_on(connect):
    replies = iter([b"error\r\n", b"unknown command\r\n", b"hello\r\n"])
    client, _ = connect(lambda _: next(replies))
    with pytest.raises(CommandError, match="answered error to 'stop'; its log has the reason"):
        client.stop()
    with pytest.raises(UnknownCommandError, match="answered unknown command to 'get status'"):
        client.get_status()
    client.hello()


@pytest.mark.parametrize(
    "reply", [b"done\r\n", b"1 2 3 4 5 6\r\n", b"1 2 3 4 5 6 7 8\r\n", b"\r\n", b"\xff\r\n"]
)
def test_a_reply_that_does_not_fit_ends_the_connection(connect, reply):
    client, _ = connect(always(reply))
    with pytest.raises(ReplyError, match="get joint position"):
        client.get_joint_position()
    assert_closed(client)


@pytest.mark.parametrize("reply", [b"", b"x" * 100_000])
def test_no_whole_reply_ends_the_connection(connect, reply):
    client, _ = connect(always(reply))
    with pytest.raises(OSError, match="before the answer to 'get status'"):
        client.get_status()
    assert_closed(client)


def test_replies_may_come_in_pieces_and_with_any_line_end(connect):
    replies = iter([b"stopped\n", b"moving\r\n"])
    client, _ = connect(lambda _: next(replies))
    assert client.get_status() == "stopped"
    assert client.get_status() == "moving"


def test_a_silent_robot_times_out_and_the_connection_ends():
    with socket.create_server(("127.0.0.1", 0)) as silent:
        client = Iiwa(*silent.getsockname(), timeout_s=0.05)
        with pytest.raises(TimeoutError):
            client.hello()
        assert_closed(client)


def test_waiting_ends_when_the_robot_stops(connect):
    replies = iter([b"moving\r\n"] * 3 + [b"stopped\r\n"])
    client, peer = connect(lambda _: next(replies))
    client.wait_until_stopped(timeout_s=10)
    assert peer.heard == b"get status\r\n" * 4


def test_waiting_too_long_raises_and_keeps_the_connection(connect):
    client, _ = connect(always(b"moving\r\n"))
    with pytest.raises(TimeoutError, match="still moves"):
        client.wait_until_stopped(timeout_s=0)
    assert client.get_status() == "moving"


def test_it_is_a_context_manager():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        with Iiwa(*listener.getsockname()) as client:
            peer, _ = listener.accept()
        with peer:
            assert peer.recv(1) == b""
        assert_closed(client)
