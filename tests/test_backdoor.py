"""The backdoor of a simulator over real sockets: a driver sees each fault, and is served afterwards."""

from __future__ import annotations

import logging
from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.controller.errors import Refused
from iiwa_sim.simulator import Simulator
from tests.drivers import connect
from tests.line_client import Client, until

FAR = "joint move : 1 1 1 -1.5 1 1 1 " + " ".join(["0.1"] * 7)


@pytest.fixture
async def simulator() -> AsyncIterator[Simulator]:
    """A simulator with a backdoor."""
    async with Simulator(backdoor_port=0) as simulator:
        yield simulator


@pytest.mark.requirement("FRC021", "FRC026")
@pytest.mark.parametrize(
    ("fault", "error", "status", "undo"),
    [
        (lambda b: b.fail(4711), "4711 made to fail through the backdoor", "2 0 1 0 0 1 4711", None),
        (
            Backdoor.emergency_stop,
            *("3030 emergency stop", "2 1 0 0 0 1 3030"),
            lambda b: b.emergency_stop(False),
        ),
    ],
)
async def test_a_driver_sees_faults_of_the_robot(
    simulator: Simulator,
    caplog: pytest.LogCaptureFixture,
    fault: Callable[[Backdoor], None],
    error: str,
    status: str,
    undo: Callable[[Backdoor], None] | None,
) -> None:
    driver, _ = await connect(simulator, "iiwa")
    assert await driver.ask(FAR) == "done"
    assert await driver.ask(FAR) == "done"
    await until(lambda: simulator.controller.joints[0] > 0.0)
    with caplog.at_level(logging.WARNING, "iiwa_sim"):
        fault(simulator.backdoor)
    assert caplog.messages == [error.partition(" ")[2]]
    await driver.until_stopped()
    assert await driver.ask("get error") == error
    assert await driver.ask("get robot status") == status
    assert await driver.ask("get mode") == "unknown"
    assert simulator.controller.joints[0] < 0.9
    assert await driver.ask(FAR) == "error"
    assert await driver.ask("reset error") == ("error" if undo else "done")
    if undo:
        undo(simulator.backdoor)
        assert await driver.ask("reset error") == "done"
    assert await driver.ask("get error") == "0 none"
    assert await driver.ask("get robot status") == "2 0 1 1 0 0 0"
    assert await driver.ask(FAR) == "done"
    await driver.leaves()


async def test_the_driver_reads_pushes_and_inputs_of_the_backdoor(simulator: Simulator) -> None:
    driver, _ = await connect(simulator, "iiwa")
    simulator.backdoor.push((1, -2, 3, 0.5, 0, 0))
    assert await driver.ask("get cartesian force") == "1.0 -2.0 3.0 0.5 0.0 0.0"
    simulator.backdoor.release()
    simulator.backdoor.push_joints((1, 2, 3, 4, 5, 6, 7))
    assert await driver.ask("get joint torque") == "1.0 2.0 3.0 4.0 5.0 6.0 7.0"
    simulator.backdoor.set_input(2, True)
    assert await driver.ask("get input : 2") == "1"
    assert await driver.ask("set output : 5 1") == "done"
    assert simulator.state().outputs[4]
    simulator.backdoor.restore_state("start")
    assert await driver.ask("get joint torque") == "0.0 0.0 0.0 0.0 0.0 0.0 0.0"
    assert await driver.ask("get inputs") == await driver.ask("get outputs") == " ".join("0" * 16)
    await driver.leaves()


async def test_arguments_in_python_get_the_types_of_the_calls(simulator: Simulator) -> None:
    calls: Any = simulator.backdoor
    for call, *wrong in ((calls.emergency_stop, "yes"), (calls.set_input, 1, "on"), (calls.fail, "3060")):
        with pytest.raises(Refused, match="Expected `"):
            call(*wrong)
    calls.set_tool((0, 0, 150, 0, 0, 0))
    assert simulator.state().tool_frame != simulator.state().flange_frame


async def test_a_push_moves_a_resting_robot_on_a_fast_clock() -> None:
    async with Simulator(clock="fast", backdoor_port=0) as simulator:
        driver = await Client.connect(simulator.port)
        assert await driver.ask("start gravity : 500") == "done"
        await until(lambda: simulator.controller.tick > 0)
        simulator.backdoor.push_joints((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 5.0))
        await until(lambda: simulator.controller.joints[6] == pytest.approx(0.01, rel=0.01))
        await driver.leaves()
