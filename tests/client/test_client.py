"""Both clients, against peers that say what a test wants: what they send, and what they make of replies."""

import asyncio
import inspect
import math
import socket
import subprocess
import sys
import threading

import pytest

from iiwa_sim.client import (
    AsyncIiwa,
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
from iiwa_sim.dialect.wire.table_file import load_table
from tests.asked import joint_move, lin_move, lin_relative_move, ptp_move
from tests.client.peers import Answer, be_impatient
from tests.dialect.fake_robot import FakeRobot, IiwaSession
from tests.journal import Journal
from tools.client_source import iiwa as client_source
from tools.client_source.text import FOLDER

TABLE = load_table("iiwa")
KINDS = (Iiwa, AsyncIiwa)
CLIENTS = pytest.mark.parametrize("kind", KINDS)
FRAME = (600.0, -0.5, 500.0, 3.0, 0.25, -3.0)
JOINTS = (0.0, 0.5, -0.25, -1.0, 0.0, 0.0, 1.5)
SPEEDS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 1.0)


def speaking_for(robot: FakeRobot) -> Answer:
    """Our own dialect as the other end."""
    session = IiwaSession(robot, Journal(), "client")

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


@pytest.mark.parametrize("kind", client_source.KINDS, ids=lambda kind: kind.name)
def test_the_methods_are_what_the_table_makes_of_them(kind):
    written = (FOLDER / kind.file).read_text()
    assert written == client_source.source(kind), "python -m tools.client_source writes it anew"


@CLIENTS
@pytest.mark.parametrize("name", TABLE.commands)
def test_a_method_for_every_command_with_the_tables_parameters(kind, name):
    command = TABLE.commands[name]
    arguments = list(inspect.signature(getattr(kind, name.replace(" ", "_"))).parameters)[1:]
    values = [value for argument in arguments for value in client_source.GROUPS.get(argument, (argument,))]
    known = [each.name for each in (*command.parameters, *command.optional)]
    assert values == ([command.phrase] if command.phrase else known)


def test_values_are_read_into_rows_of_their_names():
    for command in TABLE.commands.values():
        result = inspect.get_annotations(getattr(Iiwa, command.name.replace(" ", "_")))["return"]
        if len(command.reply_values) > 1:
            assert result._fields == tuple(each.name for each in command.reply_values)


@CLIENTS
def test_no_method_that_the_table_does_not_know(kind):
    methods = {name for name, _ in inspect.getmembers(kind, inspect.isfunction) if not name.startswith("_")}
    ours = {"close", "reconnect", "wait_until_stopped"}
    assert methods - {name.replace(" ", "_") for name in TABLE.commands} == ours


def test_it_needs_nothing_of_the_server():
    done = subprocess.run(
        [sys.executable, "-c", "import sys, iiwa_sim.client; print(*sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    )
    loaded = set(done.stdout.split())
    assert not loaded & {"pinocchio", "numpy", "ruckig", "msgspec"}
    assert all(name.startswith("iiwa_sim.client") for name in loaded if name.startswith("iiwa_sim."))


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
        lin_move(FRAME, 0.5, 0.0),
        ptp_move(FRAME, 1e-5, 10.0),
        lin_move(FRAME, 0.5, 0.0, 1.25),
        ptp_move(FRAME, 0.5, 0.0, -1.25),
        joint_move(JOINTS, SPEEDS),
        ptp_move((*FRAME[:3], math.pi, 0.0, 0.0), 0.5, 0.0),
        lin_relative_move(FRAME, 0.5, 5.0, in_tool=True),
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


@pytest.mark.parametrize("reply", [b"nan 0 0 0 0 0 0\r\n", b"0 0 0 0 0 0 1e999\r\n", b"0 0 0 0 0 0 1_0\r\n"])
def test_a_reply_of_numbers_that_are_none_ends_the_connection(connect, reply):
    client, _ = connect(always(reply))
    with pytest.raises(ReplyError, match="get joint position"):
        client.get_joint_position()
    assert_closed(client)


@pytest.mark.parametrize("reply", [b"", b"x" * 100_000])
def test_no_whole_reply_ends_the_connection(connect, reply):
    client, _ = connect(always(reply))
    with pytest.raises(OSError, match="the connection ended before the answer to 'get status'"):
        client.get_status()
    assert_closed(client)


def test_a_reply_that_nobody_asked_for_ends_the_connection(connect):
    client, _ = connect(always(b"stopped\r\nstopped\r\n"))
    assert client.get_status() == "stopped"
    with pytest.raises(ReplyError, match=r"b'stopped.*' came unasked, before 'get status'"):
        client.get_status()
    assert_closed(client)


def test_replies_may_end_in_any_way(connect):
    replies = iter(
        [b"stopped\n", b"moving\r\n", b"stopped\n\r", b"moving\r", b"\nstopped\r\n", b"\nmoving\n"]
    )
    client, _ = connect(lambda _: next(replies))
    heard = [client.get_status() for _ in range(4)]
    assert heard == ["stopped", "moving", "stopped", "moving"]
    assert client.get_status() == "stopped", "the first byte ends the reply before"
    with pytest.raises(ReplyError):
        client.get_status()


def test_a_reply_may_come_in_pieces(open_client):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        client = open_client(listener.getsockname()[1])
        peer, _ = listener.accept()

        def answer():
            peer.recv(64)
            for piece in (b"stop", b"ped", b"\r"):
                peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                peer.sendall(piece)

        with peer:
            thread = threading.Thread(target=answer)
            thread.start()
            assert client.get_status() == "stopped"
            thread.join()
            client.close()


def test_a_silent_robot_times_out_and_the_connection_ends(open_client):
    with socket.create_server(("127.0.0.1", 0)) as silent:
        client = open_client(silent.getsockname()[1])
        be_impatient(client)
        with pytest.raises(TimeoutError, match=r"no answer to 'hello' within 0\.05 s"):
            client.hello()
        assert_closed(client)


def test_a_closed_connection_can_be_opened_again(open_client):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        client = open_client(listener.getsockname()[1])
        first, _ = listener.accept()
        first.close()
        with pytest.raises(ConnectionError):
            client.hello()
        client.reconnect()
        second, _ = listener.accept()
        with second:
            answering = threading.Thread(target=lambda: second.sendall(second.recv(64)))
            answering.start()
            client.hello()
            answering.join()
            client.close()


def test_nobody_listens(open_client):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with pytest.raises(ConnectionRefusedError):
        open_client(port)


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


def test_the_blocking_client_is_a_context_manager():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        with Iiwa(*listener.getsockname()) as client:
            peer, _ = listener.accept()
        with peer:
            assert peer.recv(1) == b""
        assert_closed(client)


async def test_the_async_client_is_a_context_manager(simulator):
    async with AsyncIiwa("127.0.0.1", simulator.port) as client:
        await client.hello()
    with pytest.raises(ConnectionError, match="this connection is closed"):
        await client.hello()


async def test_tasks_may_share_the_async_client(simulator):
    async with AsyncIiwa("127.0.0.1", simulator.port) as robot:
        answers = await asyncio.gather(
            *(robot.get_status() for _ in range(20)), *(robot.get_mode() for _ in range(20))
        )
    assert answers == ["stopped"] * 20 + ["unknown"] * 20


async def test_a_task_that_is_cancelled_takes_the_connection_with_it():
    with socket.create_server(("127.0.0.1", 0)) as silent:
        async with AsyncIiwa(*silent.getsockname()) as robot:
            task = asyncio.create_task(robot.hello())
            await asyncio.sleep(0)
            task.cancel()
            with pytest.raises(asyncio.CancelledError):
                await task
            with pytest.raises(ConnectionError, match="this connection is closed"):
                await robot.hello()
