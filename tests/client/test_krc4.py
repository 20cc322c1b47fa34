"""Both KRC4 clients: against a simulator, and against peers that say what a test wants."""

from __future__ import annotations

import asyncio
import inspect
import math
import socket
from collections.abc import Callable, Iterator

import pytest

from iiwa_sim.client import AsyncKrc4, CommandError, Krc4, Krc4Error, Krc4Frame, ReplyError
from iiwa_sim.client._generated.krc4_numbers import COMMANDS, ERRORS
from iiwa_sim.dialect.krc4.table import load_krc4_table
from iiwa_sim.dialect.wire.error_codes import load_error_codes
from iiwa_sim.simulator import Simulator
from tests.client.krc4_peers import assert_closed, replying
from tests.client.peers import Peer
from tools.client_source import krc4 as client_source
from tools.client_source.text import FOLDER

TABLE = {command.tag: command for command in load_krc4_table().commands.values()}
KINDS = (Krc4, AsyncKrc4)
CLIENTS = pytest.mark.parametrize("kind", KINDS)
HOME_DEG = (0.0, -90.0, 90.0, 0.0, 90.0, 0.0)
NEAR_DEG = (2.0, -90.0, 90.0, 0.0, 90.0, 0.0)
FAR_DEG = (160.0, 40.0, -100.0, 0.0, 90.0, 0.0)
BESIDE = Krc4Frame(445.0, 20.0, 800.0, 180.0, 0.0, 180.0)
IIWA_DEG = (5.0, 30.0, 0.0, -60.0, 0.0, 90.0, 10.0)
DEADLINE_S = 30.0


@pytest.fixture(scope="module")
def six_axes() -> Iterator[Simulator]:
    with Simulator("kr_6_r900_sixx", dialects=["krc4"], clock="fast") as simulator:
        yield simulator


@pytest.fixture
def robot(six_axes: Simulator, open_client: Callable[..., Krc4]) -> Krc4:
    return open_client(six_axes.port)


@pytest.mark.parametrize("kind", client_source.KINDS, ids=lambda kind: kind.name)
def test_the_methods_are_what_the_table_makes_of_them(kind: client_source.Kind) -> None:
    written = (FOLDER / kind.file).read_text()
    assert written == client_source.source(kind), "python -m tools.client_source writes it anew"


def test_the_numbers_are_those_of_the_table() -> None:
    assert (FOLDER / client_source.NUMBERS).read_text() == client_source.numbers_source()
    assert {tag: command.id for tag, command in TABLE.items()} == COMMANDS
    assert {code: row.meaning for code, row in load_error_codes().items()} == ERRORS


@CLIENTS
def test_a_method_for_every_message_and_no_other(kind: type) -> None:
    methods = {name for name, _ in inspect.getmembers(kind, inspect.isfunction) if not name.startswith("_")}
    assert methods == {tag.lower() for tag in TABLE} | {"close", "reconnect", "wait_until_stopped"}


def test_each_method_does_what_its_message_says(robot: Krc4) -> None:
    robot.pta(HOME_DEG)
    robot.wait_until_stopped(DEADLINE_S)
    assert robot.gop() == pytest.approx((445, 0, 810, 180, 0, 180), abs=1e-6)
    robot.lin(BESIDE)
    assert robot.gop()[:3] == pytest.approx(BESIDE[:3])
    robot.wait_until_stopped(DEADLINE_S)
    assert robot.fin() is True
    assert robot.dis() == pytest.approx(0.0, abs=1e-6)
    assert robot.gop().y_mm == pytest.approx(BESIDE.y_mm)
    robot.lia(NEAR_DEG)
    robot.wait_until_stopped(DEADLINE_S)
    assert robot.goa() == pytest.approx(NEAR_DEG, abs=1e-6)
    robot.ptp(BESIDE)
    robot.wait_until_stopped(DEADLINE_S)
    assert robot.gop()[:3] == pytest.approx(BESIDE[:3])
    robot.sio(5, True)
    assert robot.gio(5) is True
    robot.sio(5, False)
    assert robot.gio(5) is False
    assert robot.gio(17) is False, "input 1"


def test_a_stop_is_seen_on_the_way(open_client: Callable[..., Krc4]) -> None:
    with Simulator("kr_6_r900_sixx", dialects=["krc4"], clock="stepped") as simulator:
        robot = open_client(simulator.port)
        robot.pta(FAR_DEG)
        simulator.advance(0.2)
        assert robot.fin() is False
        assert robot.dis() > 100
        assert robot.goa() == pytest.approx(FAR_DEG)
        with pytest.raises(TimeoutError, match="still moves"):
            robot.wait_until_stopped(timeout_s=0)
        robot.sto()
        simulator.run_until_stopped()
        robot.wait_until_stopped(timeout_s=0)
        assert robot.goa() != pytest.approx(FAR_DEG, abs=1)


def test_an_iiwa_has_seven_axes(open_client: Callable[..., Krc4]) -> None:
    with Simulator("lbr_iiwa_7_r800", dialects=["krc4"], clock="fast") as simulator:
        robot = open_client(simulator.port, axes=7)
        robot.pta(IIWA_DEG)
        robot.wait_until_stopped(DEADLINE_S)
        assert robot.goa() == pytest.approx(IIWA_DEG)
        frame = robot.gop()
        robot.lin(frame._replace(z_mm=frame.z_mm + 20))
        robot.wait_until_stopped(DEADLINE_S)
        robot.lia(IIWA_DEG)
        robot.wait_until_stopped(DEADLINE_S)
        assert robot.gop() == pytest.approx(frame, abs=1e-6)
        with pytest.raises(ValueError, match="joints_deg: expected 7 numbers, got 6"):
            robot.pta(HOME_DEG)
        narrow = open_client(simulator.port)
        with pytest.raises(ReplyError, match="R6=10"):  # an axis more than it was told
            narrow.goa()
        assert_closed(narrow)


def test_a_refusal_has_its_number_and_the_connection_lives_on(robot: Krc4, six_axes: Simulator) -> None:
    refused = {
        3021: lambda: robot.ptp((9999, 0, 0, 0, 0, 0)),
        3023: lambda: robot.pta((171, *HOME_DEG[1:])),
        1: lambda: robot.gio(99),
        2: lambda: robot.sio(17, True),
        3030: lambda: robot.pta(HOME_DEG),
    }
    for code, call in refused.items():
        if code == 3030:
            six_axes.backdoor.emergency_stop()
        with pytest.raises(Krc4Error, match=f"with error {code}: {ERRORS[code][:20]}") as raised:
            call()
        assert raised.value.code == code
        assert isinstance(raised.value, CommandError)
        assert robot.fin() is True
    six_axes.backdoor.release_emergency_stop()
    six_axes.call(six_axes.controller.reset_error)


def test_closing_stops_the_move(open_client: Callable[..., Krc4]) -> None:
    with Simulator("kr_6_r900_sixx", dialects=["krc4"], clock="stepped") as simulator:
        robot = open_client(simulator.port)
        robot.pta(FAR_DEG)
        robot.close()
        assert_closed(robot)
        robot.reconnect()
        simulator.advance(0.01)
        simulator.run_until_stopped()
        assert robot.fin() is True
        assert robot.goa() != pytest.approx(FAR_DEG, abs=1)


async def test_tasks_may_share_the_async_client() -> None:
    async with (
        Simulator("kr_6_r900_sixx", dialects=["krc4"]) as simulator,
        AsyncKrc4("127.0.0.1", simulator.port) as robot,
    ):
        idle = asyncio.gather(*(robot.fin() for _ in range(20)))
        far = asyncio.gather(*(robot.dis() for _ in range(20)))
        assert await idle == [True] * 20
        assert await far == pytest.approx([0.0] * 20, abs=1e-6)


async def test_a_task_that_is_cancelled_takes_the_connection_with_it() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        async with AsyncKrc4(*silent.getsockname()) as robot:
            task = asyncio.create_task(robot.fin())
            await asyncio.sleep(0)
            task.cancel()
            with pytest.raises(asyncio.CancelledError):
                await task
            with pytest.raises(ConnectionError, match="this connection is closed"):
                await robot.fin()


def test_the_blocking_client_is_a_context_manager() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        with Krc4(*listener.getsockname()) as client:
            peer, _ = listener.accept()
        with peer:
            assert peer.recv(1) == b""
        assert_closed(client)


@CLIENTS
@pytest.mark.parametrize("axes", [0, -1, 11])
def test_a_message_has_room_for_ten_axes(kind: Callable[..., object], axes: int) -> None:
    with pytest.raises(ValueError, match="axes: expected 1 to 10"):
        kind("127.0.0.1", 1, axes=axes)


@pytest.mark.parametrize(
    "call",
    [
        lambda client: client.lin(BESIDE[:5]),
        lambda client: client.ptp((*BESIDE, 0.0)),
        lambda client: client.pta(HOME_DEG[:5]),
        lambda client: client.lia((*HOME_DEG, 0.0)),
        lambda client: client.lin((math.nan, *BESIDE[1:])),
        lambda client: client.pta([math.inf] * 6),
        lambda client: client.sio(2**31, True),
        lambda client: client.gio(-(2**31) - 1),
        lambda client: client.gio(math.nan),
        lambda client: client.gio(1.5),
    ],
)
def test_wrong_numbers_are_never_sent(
    connect: Callable[..., tuple[Krc4, Peer]], call: Callable[[Krc4], object]
) -> None:
    client, peer = connect(replying(I2=1))
    with pytest.raises(ValueError, match="expected"):
        call(client)
    assert client.fin()
    assert peer.heard.count(b"<Cmd>") == 1
