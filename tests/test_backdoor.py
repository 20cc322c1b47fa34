"""The backdoor of a simulator over real sockets: what a driver sees of each fault, and that it serves on."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import AsyncIterator
from importlib.resources import files
from pathlib import Path

import pytest

from iiwa_sim.client import Iiwa
from iiwa_sim.controller.errors import Refused
from iiwa_sim.protocols.table import load_table
from iiwa_sim.server.listening import ListenFault
from iiwa_sim.simulator import Simulator
from iiwa_sim.transcript.lines import read
from iiwa_sim.transcript.replay import replay
from tests.drivers import connect
from tests.talking import Client, until

FAR = "joint move : 1 1 1 -1.5 1 1 1 " + " ".join(["0.1"] * 7)
PIPELINED = b"hello\r\nget mode\r\nget override\r\n"
ANSWERED = b"hello\r\nunknown\r\n1.0\r\n"
LATE_S = 0.2
_TEXT = files("iiwa_sim.protocol").joinpath("transcripts/backdoor/backdoor.txt").read_text()
DIALOGUE = read("backdoor.txt", _TEXT)
NOT_IN_IT = {"get state", "get dialogue", "get robot", "get cell"}  # they tell when that was, or too much
PAGE = (Path(__file__).parent.parent / "docs" / "backdoor.md").read_text()
A_WHILE = 20  # answers to somebody else, as a measure of time


@pytest.fixture
async def simulator() -> AsyncIterator[Simulator]:
    """One with a backdoor."""
    async with Simulator(backdoor_port=0) as simulator:
        yield simulator


async def told(bench: Client, line: str) -> None:
    assert await bench.ask(line) == "done"


async def answers(other: Client) -> None:
    """Somebody else is answered as ever, and some time passes."""
    for _ in range(A_WHILE):
        other.send(PIPELINED)
        assert [await other.reply() for _ in range(3)] == ANSWERED.decode().split()


async def came(driver: Client, count: int) -> bytes:
    """What has come, once it is this number of bytes."""
    await until(lambda: len(driver.unread) >= count)
    return driver.unread


@pytest.mark.parametrize("accept", [True, False])
async def test_a_simulator_that_ends_while_it_refuses(accept: bool) -> None:
    async with Simulator() as simulator:
        port = simulator.port
        simulator.backdoor.refuse_connections()
        if accept:
            simulator.backdoor.accept_connections()
    with pytest.raises(ConnectionRefusedError):
        await Client.connect(port)
    with socket.create_server(("127.0.0.1", port)):
        pass  # the port is free


@pytest.mark.requirement("FRC021", "FRC026")
@pytest.mark.parametrize(
    ("line", "error", "status", "undone"),
    [
        ("fail move : 4711", "4711 made to fail through the backdoor", "2 0 1 0 0 1 4711", ""),
        ("emergency stop", "3030 emergency stop", "2 1 0 0 0 1 3030", "release emergency stop"),
    ],
)
async def test_what_a_driver_sees_of_a_fault_of_the_robot(
    simulator: Simulator,
    bench: Client,
    caplog: pytest.LogCaptureFixture,
    line: str,
    error: str,
    status: str,
    undone: str,
) -> None:
    driver, _ = await connect(simulator, "iiwa")
    assert await driver.ask(FAR) == "done"
    assert await driver.ask(FAR) == "done"
    await until(lambda: simulator.controller.joints[0] > 0.0)
    with caplog.at_level(logging.WARNING, "iiwa_sim"):
        await told(bench, line)
    assert caplog.messages == [error.partition(" ")[2]]
    await driver.until_stopped()
    assert await driver.ask("get error") == error
    assert await driver.ask("get robot status") == status
    assert await driver.ask("get mode") == "unknown"
    assert simulator.controller.joints[0] < 0.9
    assert await driver.ask(FAR) == "error"
    assert await driver.ask("reset error") == ("error" if undone else "done")
    if undone:
        await told(bench, undone)
        assert await driver.ask("reset error") == "done"
    assert await driver.ask("get error") == "0 none"
    assert await driver.ask("get robot status") == "2 0 1 1 0 0 0"
    assert await driver.ask(FAR) == "done"
    await driver.leaves()


async def test_the_next_move_is_refused_and_the_one_behind_it_not(
    simulator: Simulator, bench: Client
) -> None:
    driver, _ = await connect(simulator, "iiwa")
    await told(bench, "refuse next move : 3021")
    assert await driver.ask("get mode") == "unknown"
    assert await driver.ask("is reachable : 450 200 520 0 -1.57 0") == "reachable"
    assert await driver.ask(FAR) == "error"
    assert await driver.ask("get error") == "3021 made to fail through the backdoor"
    assert await driver.ask("get robot status") == "2 0 1 1 0 0 0", "a refusal is no error state"
    assert await driver.ask(FAR) == "done"
    await driver.leaves()


async def test_krc4_messages_cannot_be_canned() -> None:
    async with Simulator("kr_6_r900_sixx", protocol=["krc4"], clock="stepped") as robot:
        with pytest.raises(Refused, match="reply to 'hello': expected a robot that speaks iiwa"):
            robot.backdoor.reply("hello", "hello")


async def test_the_driver_reads_what_the_bench_pushes_and_switches(
    simulator: Simulator, bench: Client
) -> None:
    driver, _ = await connect(simulator, "iiwa")
    await told(bench, "push : 1 -2 3 0.5 0 0")
    assert await driver.ask("get cartesian force") == "1.0 -2.0 3.0 0.5 0.0 0.0"
    await told(bench, "release")
    await told(bench, "push joints : 1 2 3 4 5 6 7")
    assert await driver.ask("get joint torque") == "1.0 2.0 3.0 4.0 5.0 6.0 7.0"
    await told(bench, "set input : 2 1")
    assert await driver.ask("get input : 2") == "1"
    assert await driver.ask("set output : 5 1") == "done"
    assert await bench.ask("get output : 5") == "1"
    await told(bench, "restore state : start")
    assert await driver.ask("get joint torque") == "0.0 0.0 0.0 0.0 0.0 0.0 0.0"
    assert await driver.ask("get inputs") == await driver.ask("get outputs") == " ".join("0" * 16)
    await driver.leaves()


async def test_there_is_none_unless_it_is_asked_for_and_only_on_this_machine(simulator: Simulator) -> None:
    assert Simulator().backdoor_port is None
    async with Simulator(host="0.0.0.0", backdoor_port=0) as everywhere:
        assert everywhere.backdoor_port is not None
        assert everywhere.backdoor_host == "127.0.0.1"
    second = Simulator(status_port=0, backdoor_port=simulator.backdoor_port)
    with pytest.raises(ListenFault, match=f"^cannot listen on 127.0.0.1:{simulator.backdoor_port}: "):
        await second.__aenter__()
    for port in (lambda: second.port, lambda: second.status_port):
        with pytest.raises(RuntimeError, match="does not listen"):
            port()


async def test_its_dialogue_is_answered_as_it_says(simulator: Simulator) -> None:
    assert simulator.backdoor_port is not None
    port = simulator.backdoor_port
    played = await asyncio.to_thread(lambda: list(replay(DIALOGUE, "127.0.0.1", port)))
    assert list(map(str, played)) == []


def test_every_command_is_in_the_dialogue_and_on_the_page() -> None:
    commands = set(load_table("backdoor", 7).commands)
    assert commands - NOT_IN_IT <= DIALOGUE.commands
    assert {name for name in commands if f"`{name} :" in PAGE or f"`{name}`" in PAGE} == commands


def test_from_another_thread_while_the_robot_moves() -> None:
    with (
        Simulator(clock="stepped", backdoor_port=0) as simulator,
        Iiwa(simulator.host, simulator.port) as robot,
    ):
        robot.joint_move((1, 1, 1, -1.5, 1, 1, 1), (0.1,) * 7)
        simulator.advance(1.0)
        with pytest.raises(Refused, match="the robot has to be at rest"):
            simulator.backdoor.place((0.0,) * 7)
        simulator.backdoor.fail_move(3000)
        assert simulator.run_until_stopped() <= 0.1
        assert robot.get_error().reason == "made to fail through the backdoor"
        simulator.backdoor.restore_state("start")
        assert simulator.backdoor.state().error.code == 0
        assert simulator.joints == simulator.cell.description.home
        assert list(simulator.backdoor.connections()) == [1]


async def test_time_is_told_over_the_socket_and_lines_behind_wait_for_it() -> None:
    async with Simulator(clock="stepped", backdoor_port=0) as simulator:
        assert simulator.backdoor_port is not None
        driver = await Client.connect(simulator.port)
        bench = await Client.connect(simulator.backdoor_port)
        assert await driver.ask(FAR) == "done"
        assert await driver.ask("get status") == "moving"
        bench.send(b"advance : 3\r\nget clock\r\nrun until stopped : 0\r\nrun until stopped : 600\r\n")
        assert await bench.reply() == "done"
        assert simulator.controller.tick >= 1500
        assert await bench.reply() == "stepped"
        assert (await bench.reply()).startswith("error 3000 the robot still moves after 0 s")
        assert float(await bench.reply()) > 1.0
        assert await driver.ask("get joint position") == "1.0 1.0 1.0 -1.5 1.0 1.0 1.0"
        await driver.leaves()
        await bench.leaves()


async def test_in_haste_a_push_that_moves_the_robot_is_noticed() -> None:
    async with Simulator(clock="fast", backdoor_port=0) as simulator:
        driver = await Client.connect(simulator.port)
        assert await driver.ask("start gravity : 500") == "done"
        await until(lambda: simulator.controller.tick > 0)
        simulator.backdoor.push_joints((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5.0))
        await until(lambda: simulator.controller.joints[6] == pytest.approx(0.01, rel=0.01))
        await driver.leaves()
