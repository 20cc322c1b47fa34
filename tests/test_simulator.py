"""The simulator as a whole, in process, over real sockets."""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path

import pytest

from iiwa_sim.simulator import Simulator
from tests.line_client import Client, until

EXAMPLES = Path(__file__).parent.parent / "examples"
FAR = "joint move : 1 1 1 -1.5 1 1 1 " + " ".join(["0.1"] * 7)
NEAR = "joint move : 0.01 0.52 0 -1.04 0 1.57 0 " + " ".join(["1"] * 7)


@pytest.mark.requirement("FRA003", "FRA004", "FRA006", "FRA101", "FRA102", "FRA104")
async def test_a_move_runs_while_the_client_polls(simulator: Simulator, client: Client) -> None:
    assert await client.ask(NEAR) == "done"
    assert await client.until_stopped() > 0, "done means accepted, not arrived"
    assert await client.ask("get joint position") == "0.01 0.52 0.0 -1.04 0.0 1.57 0.0"
    assert simulator.controller.tick > 0


@pytest.mark.requirement("FRC021", "FRC026")
async def test_an_error_is_reported_to_all_and_reset_by_any(simulator: Simulator, client: Client) -> None:
    other = await Client.connect(simulator.port)
    assert await client.ask(FAR) == "done"
    simulator.controller.emergency_stop()
    simulator.controller.emergency_stop(pressed=False)
    assert await client.ask(FAR) == "error"
    assert await other.ask("get error") == "3030 emergency stop"
    assert await other.ask("reset error") == "done"
    assert await client.ask(NEAR) == "done"
    await other.leaves()


@pytest.mark.parametrize("how", ["vanishes", "bye", "sends no more"])
async def test_a_client_that_disconnects_stops_the_robot_it_moved(
    simulator: Simulator, caplog: pytest.LogCaptureFixture, how: str
) -> None:
    client = await Client.connect(simulator.port)
    for _ in range(3):
        assert await client.ask(FAR) == "done"
    await until(lambda: simulator.controller.joints[0] > 0)
    if how == "vanishes":
        client.vanishes()
    elif how == "bye":
        assert await client.ask("bye") == "bye"
        assert await client.rest() == b""
    else:
        client.sends_no_more()
        assert await client.rest() == b""
    await until(lambda: not simulator.controller.moving)
    assert simulator.controller.joints[0] < 0.5
    warnings = [record.getMessage() for record in caplog.records if record.levelno == logging.WARNING]
    if how == "bye":
        assert warnings == []
    else:
        (warning,) = warnings
        assert "vanished while the robot moved" in warning
    await client.leaves()


async def test_a_client_that_only_reads_may_disconnect(simulator: Simulator, client: Client) -> None:
    looker_on = await Client.connect(simulator.port)
    assert await client.ask(FAR) == "done"
    assert await looker_on.ask("get status") == "moving"
    looker_on.vanishes()
    await until(lambda: len(simulator.robots[""].servers["iiwa"].connections) == 1)
    assert await client.ask("get status") == "moving"
    assert await client.ask(FAR) == "done"


@pytest.mark.requirement("FRA003", "FRA104")
async def test_50_connections_at_once(simulator: Simulator) -> None:
    clients = await asyncio.gather(*(Client.connect(simulator.port) for _ in range(50)))
    assert await clients[0].ask(FAR) == "done"

    async def converse(client: Client) -> list[str]:
        return [await client.ask(command) for command in ["hello", "get status", "nonsense"] * 5]

    conversations = await asyncio.gather(*(converse(client) for client in clients))
    assert conversations == [["hello", "moving", "unknown command"] * 5] * 50
    await asyncio.gather(*(client.leaves() for client in clients))
