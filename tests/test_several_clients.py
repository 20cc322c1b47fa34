"""Several clients of one robot, over real sockets: all at once, or one after the other."""

from __future__ import annotations

import asyncio

import pytest

from iiwa_sim.client import Iiwa
from iiwa_sim.simulator import Simulator
from tests import drivers
from tests.drivers import ONE_OF_EACH_PROTOCOL, SCENES
from tests.processes import running
from tests.talking import DEADLINE_S, Client, until

NEAR = "joint move : 0.01 0.52 0 -1.04 0 1.57 0 " + " ".join(["1"] * 7)


async def connect(simulator: Simulator) -> Client:
    """A client that the server knows of."""
    count = len(simulator.robots[""].servers["iiwa"].connections)
    client = await Client.connect(simulator.port)
    await until(lambda: len(simulator.robots[""].servers["iiwa"].connections) == count + 1)
    return client


@pytest.mark.parametrize("exclusive", [False, True])
async def test_a_pause_before_the_next_client_is_served(exclusive: bool) -> None:
    pause_s = 0.1
    loop = asyncio.get_running_loop()
    async with Simulator(exclusive=exclusive, reconnect_pause_s=pause_s) as simulator:
        first = await connect(simulator)
        assert await first.ask("hello") == "hello", "the first one of all waits for nobody"
        over = loop.create_future()
        loop.call_later(pause_s, over.set_result, None)
        await first.leaves()
        await until(lambda: not simulator.robots[""].servers["iiwa"].connections)
        next_one = await connect(simulator)
        assert await next_one.ask("hello") == "hello"
        assert over.done()
        await next_one.leaves()


def test_a_bye_ends_the_process_if_it_shall() -> None:
    with running("--bye-shuts-down", "--status-port", "0") as simulator:
        with Iiwa("127.0.0.1", simulator.port) as early:
            early.hello()
        with Iiwa("127.0.0.1", simulator.port) as robot:
            robot.joint_move((1, 1, 1, -1.5, 1, 1, 1), (0.1,) * 7)
            robot.bye()
            _, said = simulator.process.communicate(timeout=DEADLINE_S)
        assert (simulator.process.returncode, said) == (0, "")


@pytest.mark.parametrize("name", ONE_OF_EACH_PROTOCOL)
async def test_exclusive_means_one_after_the_other_of_all_protocols(name: str) -> None:
    scene = SCENES[name]
    async with scene.simulator(exclusive=True) as simulator:
        first, _ = await drivers.connect(simulator, scene.spoken)
        second, _ = await drivers.connect(simulator, scene.other)
        third, _ = await drivers.connect(simulator, scene.spoken)
        for each in (second, third):
            each.send(b"".join(each.QUESTIONS))
            await each.sent()
        simulator.backdoor.set_override(0.2)
        simulator.backdoor.clear_faults()  # admits nobody
        assert await first.moves(scene.far) == 0
        await until(lambda: simulator.joints != simulator.cell.start)
        assert second.unread == third.unread == b""
        await first.leaves()
        await until(lambda: second.unread != b"")
        await second.whole_reply()  # whether the robot still brakes is up to the machine
        await second.whole_reply()
        await second.whole_reply()
        await second.until_stopped()
        assert third.unread == b"", "one at a time"
        assert simulator.joints != pytest.approx(scene.far, abs=0.1)
        await second.leaves()
        assert [await third.whole_reply() for _ in range(3)] == list(third.ANSWERS)
        await third.leaves()
