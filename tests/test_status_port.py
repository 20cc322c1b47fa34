"""The status port of a simulator, over real sockets."""

from __future__ import annotations

import socket
from collections.abc import AsyncIterator

import pytest

from iiwa_sim.server.listening import ListenFault
from iiwa_sim.simulator import Simulator
from tests.drivers import ONE_OF_EACH_PROTOCOL, SCENES, Driver, Scene, connect
from tests.line_client import Client, until
from tests.states import state

FAR = "joint move : 1 1 1 -1.5 1 1 1 " + " ".join(["0.1"] * 7)


@pytest.fixture
async def simulator() -> AsyncIterator[Simulator]:
    """A simulator with a status port."""
    async with Simulator(status_port=0) as simulator:
        yield simulator


@pytest.fixture
async def reader(simulator: Simulator) -> AsyncIterator[Client]:
    assert simulator.status_port is not None
    reader = await Client.connect(simulator.status_port)
    yield reader
    await reader.leaves()


async def next_state(reader: Client) -> dict[str, object]:
    return state((await reader.line()).encode() + b"\n")


async def moving_state(reader: Client) -> dict[str, object]:
    """Return the first line in which the robot moves: earlier ones may still be in flight."""
    while (seen := await next_state(reader))["status"] != "moving":
        pass
    return seen


@pytest.fixture(params=ONE_OF_EACH_PROTOCOL)
def scene(request: pytest.FixtureRequest) -> Scene:
    return SCENES[request.param]


@pytest.fixture
async def of_the_scene(scene: Scene) -> AsyncIterator[tuple[Simulator, Driver, Client]]:
    """A simulator, whose moves take their time, a driver, and a reader of its status port."""
    async with scene.simulator(status_port=0) as simulator:
        simulator.backdoor.set_override(0.2)
        driver, _ = await connect(simulator, scene.spoken)
        assert simulator.status_port is not None
        reader = await Client.connect(simulator.status_port)
        yield simulator, driver, reader
        await driver.leaves()
        await reader.leaves()


@pytest.mark.requirement("FRA201", "FRA007")
async def test_the_state_comes_50_times_a_second_while_the_robot_moves(
    scene: Scene, of_the_scene: tuple[Simulator, Driver, Client]
) -> None:
    simulator, driver, reader = of_the_scene
    assert await driver.moves(scene.far) == 0
    states = [await moving_state(reader)] + [await next_state(reader) for _ in range(30)]
    ticks = [seen["tick"] for seen in states]
    assert all((tick - ticks[0]) % 10 == 0 for tick in ticks), "500 ticks per second, 50 lines"
    assert ticks == sorted(set(ticks))
    assert all(seen["time_s"] == pytest.approx(seen["tick"] * 0.002) for seen in states)
    assert {seen["mode"] for seen in states} == {"normal"}
    assert states[-1]["status"] == "moving"
    positions = [seen["joint_position"][0] for seen in states]
    assert positions == sorted(positions)
    assert positions[-1] > positions[0]
    last = states[-1]
    assert last["joint_velocity"][0] > 0
    assert last["goal_joint_position"] == pytest.approx(list(scene.far))
    for key in ("joint_position", "joint_velocity", "joint_torque", "goal_joint_position"):
        assert len(last[key]) == len(simulator.joints)


@pytest.mark.requirement("FRA202", "FRC003")
async def test_stop_stops_the_robot_and_its_queue(
    scene: Scene, of_the_scene: tuple[Simulator, Driver, Client]
) -> None:
    simulator, driver, reader = of_the_scene
    for _ in range(3):
        assert await driver.moves(scene.far) == 0
    seen = await moving_state(reader)
    reader.send(b"stop\n")
    while seen["status"] == "moving":
        seen = await next_state(reader)
    assert seen["mode"] == "unknown"
    assert seen["joint_position"][0] < 0.5
    assert (await next_state(reader))["joint_velocity"] == [0.0] * len(simulator.joints)
    assert not await driver.moving()
    await driver.asks(driver.QUESTIONS[0])  # the client itself is left alone


@pytest.mark.requirement("FRA201")
async def test_stuck_readers_delay_neither_replies_nor_ticks_nor_others() -> None:
    async with Simulator(status_port=0, status_rate_hz=500) as simulator:
        stuck = [socket.socket() for _ in range(3)]
        for each in stuck:
            each.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            each.connect(("127.0.0.1", simulator.status_port))
        readers = [await Client.connect(simulator.status_port) for _ in range(2)]
        client = await Client.connect(simulator.port)
        assert await client.ask(FAR) == "done"
        held = simulator._status.connections
        await until(lambda: sum(r.transport.get_write_buffer_size() > 0 for r in held) == len(stuck))
        last = [0] * len(readers)
        for _ in range(20):
            ticks = [(await next_state(reader))["tick"] for reader in readers]
            assert all(now > before for now, before in zip(ticks, last, strict=True))
            last = ticks
            assert await client.ask("get status") == "moving"
        assert all(r.transport.get_write_buffer_size() < 2000 for r in held)
        for each in stuck:
            each.close()
        for each in [*readers, client]:
            await each.leaves()


async def test_a_status_port_in_use_is_reported_and_nothing_is_left_listening(simulator: Simulator) -> None:
    second = Simulator(status_port=simulator.status_port)
    with pytest.raises(ListenFault, match=f"^cannot listen on 127.0.0.1:{simulator.status_port}: "):
        await second.__aenter__()
    with pytest.raises(RuntimeError, match="does not listen"):
        _ = second.port
    assert second.controller.tick == 0
