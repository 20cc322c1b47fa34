"""What a test bench does to a robot, as a driver of each protocol sees it; the one whose turn it is; ends."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest

from iiwa_sim.controller.errors import Refused
from iiwa_sim.simulator import Simulator
from tests.drivers import ONE_OF_EACH_PROTOCOL, SCENES, Driver, Krc4Driver, Scene, connect
from tests.talking import until


@pytest.fixture(params=ONE_OF_EACH_PROTOCOL)
def scene(request: pytest.FixtureRequest) -> Scene:
    return SCENES[request.param]


@pytest.fixture
async def simulator(scene: Scene) -> AsyncIterator[Simulator]:
    async with scene.simulator() as simulator:
        yield simulator


@pytest.fixture
async def driver(scene: Scene, simulator: Simulator) -> AsyncIterator[Driver]:
    driver, _ = await connect(simulator, scene.spoken)
    yield driver
    await driver.leaves()


async def under_way(simulator: Simulator) -> None:
    home = simulator.cell.start
    await until(lambda: simulator.joints != home)


def numbers(values: tuple[float, ...]) -> str:
    return " ".join(map(repr, values))


async def test_pushes_are_felt_in_as_many_joints_as_there_are(simulator: Simulator) -> None:
    count = len(simulator.joints)
    torques = tuple(float(number) for number in range(1, count + 1))
    simulator.backdoor.push_joints(torques)
    assert simulator.state().joint_torque == torques
    simulator.backdoor.release()
    simulator.backdoor.push((0, 0, -20, 0, 0, 0))
    seen = simulator.state()
    assert seen.cartesian_force == (0.0, 0.0, -20.0, 0.0, 0.0, 0.0)
    assert len(seen.joint_torque) == count
    assert abs(seen.joint_torque[1]) > 1.0, "A2 carries it"
    simulator.backdoor.restore_state("start")
    assert simulator.state().joint_torque == (0.0,) * count


@pytest.mark.parametrize("scene", [SCENES["krc4 beside iiwa"]])
async def test_a_servo_mode_of_one_protocol_and_its_timeout_concern_the_other(
    scene: Scene, simulator: Simulator, driver: Krc4Driver
) -> None:
    other, _ = await connect(simulator, "iiwa")
    with pytest.raises(Refused, match="the mode is unknown: expected smart or direct"):
        simulator.backdoor.time_out_servo()
    smart = f"smart joint move : {numbers(scene.far)} {'0.1 ' * 7}"
    assert await other.ask(smart) == "done"
    await under_way(simulator)
    simulator.backdoor.time_out_servo()
    assert await driver.moves(scene.far) == 3040
    simulator.backdoor.reset_error()
    assert await other.ask(smart) == "done"
    assert await driver.moves(simulator.cell.start) == 0, "which stops what the servo did"
    assert await other.ask("get mode") == "normal"
    await driver.until_stopped()
    assert simulator.joints == pytest.approx(simulator.cell.start)
    await other.leaves()


async def test_exclusive_means_one_after_the_other_of_all_protocols(scene: Scene) -> None:
    async with scene.simulator(exclusive=True) as simulator:
        first, _ = await connect(simulator, scene.spoken)
        second, _ = await connect(simulator, scene.other)
        third, _ = await connect(simulator, scene.spoken)
        for each in (second, third):
            each.send(b"".join(each.QUESTIONS))
            await each.sent()
        simulator.backdoor.set_override(0.2)
        assert await first.moves(scene.far) == 0
        await under_way(simulator)
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
