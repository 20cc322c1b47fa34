"""The simulator as a whole, in process, over real sockets."""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path

import pytest

from iiwa_sim.clock.clock import CATCH_UP_WAKES
from iiwa_sim.controller.modes import Mode
from iiwa_sim.server.listening import ListenFault
from iiwa_sim.simulator import Simulator
from tests.talking import Client, until

EXAMPLES = Path(__file__).parent.parent / "examples"
HOME = "0.0 0.523598776 0.0 -1.047197551 0.0 1.570796327 0.0"  # 0 30 0 -60 0 90 0 deg
FAR = "joint move : 1 1 1 -1.5 1 1 1 " + " ".join(["0.1"] * 7)
NEAR = "joint move : 0.01 0.52 0 -1.04 0 1.57 0 " + " ".join(["1"] * 7)


@pytest.mark.requirement("FRA003", "FRA004", "FRA102")
async def test_ready_means_listening(client: Client) -> None:
    assert await client.ask("hello") == "hello"
    assert await client.ask("get joint position") == HOME
    assert await client.ask("get status") == "stopped"


async def test_a_driver_presses_on_the_table_of_a_cell() -> None:
    async with Simulator(cell=EXAMPLES / "table.toml") as simulator:
        client = await Client.connect(simulator.port)
        assert await client.ask("get cartesian force") == "0.0 0.0 0.0 0.0 0.0 0.0"
        assert await client.ask("lin move : 600 0 302 3.14159265359 0 3.14159265359 1 0") == "done"
        await client.until_stopped()
        force = [float(word) for word in (await client.ask("get cartesian force")).split()]
        assert force[2] == pytest.approx(-20.0, rel=1e-6)
        assert any(float(word) for word in (await client.ask("get joint torque")).split())
        await client.leaves()


async def test_every_command_has_its_reply_while_the_robot_presses() -> None:
    """Pipelined, in contact, with force moves among them that end at once and others that slide on."""
    down = "3.14159265359 0 3.14159265359"
    slide = f"lin move : 600 {{}} 302 {down} 0.1 0"
    async with Simulator(cell=EXAMPLES / "table.toml") as simulator:
        client = await Client.connect(simulator.port)
        assert await client.ask(f"lin move : 600 0 302 {down} 1 0") == "done"
        await client.until_stopped()
        commands = {
            "get cartesian force": lambda reply: float(reply.split()[2]) < -10.0,
            "get joint torque": lambda reply: any(float(word) for word in reply.split()),
            "get status": lambda reply: reply == "moving",
            slide.format(60): lambda reply: reply == "done",
            "linforcez move : 600 0 290 0 0 0 1 0 -5": lambda reply: reply == "error",
            f"linforce move : 600 -60 302 {down} 0.1 0 1 1 50": lambda reply: reply == "done",
            "get tool frame": lambda reply: abs(float(reply.split()[2]) - 302.0) < 0.001,
            "nonsense": lambda reply: reply == "unknown command",
        }
        assert await client.ask(slide.format(-60)) == "done"
        for _ in range(20):
            client.send("".join(f"{command}\r\n" for command in commands).encode())
            for command, fits in commands.items():
                reply = await client.reply()
                assert fits(reply), (command, reply)
        assert client.unread == b""
        assert await client.ask("stop") == "done"
        await client.until_stopped()
        await client.leaves()


async def test_a_cell_names_inputs_and_outputs(tmp_path: Path) -> None:
    (tmp_path / "cell.toml").write_text('[io]\ninputs = ["door"]\noutputs = 3\n')
    io = Simulator(cell=tmp_path / "cell.toml").controller.io
    assert io.input_names == ("door",)
    assert io.output_names == ("output 1", "output 2", "output 3")


@pytest.mark.requirement("FRA006", "FRA101", "FRA104")
async def test_a_move_runs_while_the_client_goes_on_asking(simulator: Simulator, client: Client) -> None:
    assert await client.ask(NEAR) == "done"
    assert await client.until_stopped() > 0, "done means accepted, not arrived"
    assert await client.ask("get joint position") == "0.01 0.52 0.0 -1.04 0.0 1.57 0.0"
    assert simulator.controller.tick > 0


async def test_a_robot_at_rest_does_not_tick_and_its_time_passes_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    simulator = Simulator(clock="100x")
    controller, ticks = simulator.controller, [0]
    step = controller.step

    def counted() -> None:
        ticks[0] += 1
        step()

    monkeypatch.setattr(controller, "step", counted)
    async with simulator:
        client = await Client.connect(simulator.port)
        await until(lambda: simulator.controller.tick > 20_000)
        assert ticks[0] <= CATCH_UP_WAKES * 50, "those of the first wake-up"
        before = simulator.controller.tick
        assert await client.ask(NEAR) == "done"
        await client.until_stopped()
        assert await client.ask("get joint position") == "0.01 0.52 0.0 -1.04 0.0 1.57 0.0"
        moved = ticks[0]
        await until(lambda: simulator.controller.tick > before + 40_000)
        assert ticks[0] <= moved + CATCH_UP_WAKES * 50
        await client.leaves()


@pytest.mark.requirement("FRA006", "FRA101")
async def test_stop_is_carried_out_in_mid_move(client: Client) -> None:
    assert await client.ask(FAR) == "done"
    assert await client.ask("stop") == "done"
    await client.until_stopped()
    joints = [float(word) for word in (await client.ask("get joint position")).split()]
    assert joints[0] < 0.5, "it stopped on its way"


@pytest.mark.requirement("FRC019", "FRC025")
async def test_a_move_is_paused_and_resumed_under_way(simulator: Simulator, client: Client) -> None:
    assert await client.ask("joint move : 0.3 0.5 0 -1 0 1.5 0 " + " ".join(["0.1"] * 7)) == "done"
    await until(lambda: simulator.controller.joints[0] > 0.01)
    assert await client.ask("set override : 0") == "done"
    await until(lambda: simulator.controller.status().in_motion == 0)
    assert await client.ask("get status") == "moving"
    joints = await client.ask("get joint position")
    tick = simulator.controller.tick
    await until(lambda: simulator.controller.tick > tick + 20)
    assert await client.ask("get joint position") == joints != HOME
    goal = await client.ask("get goal joint position")
    assert await client.ask("set override : 1") == "done"
    await client.until_stopped()
    assert await client.ask("get joint position") == goal
    assert await client.ask("get distance to goal") == "0.0"


@pytest.mark.requirement("FRC021", "FRC026")
async def test_an_error_is_told_to_everyone_and_reset_by_anyone(simulator: Simulator, client: Client) -> None:
    other = await Client.connect(simulator.port)
    assert await client.ask(FAR) == "done"
    simulator.controller.emergency_stop()
    simulator.controller.release_emergency_stop()
    assert await client.ask(FAR) == "error"
    assert await other.ask("get error") == "3030 emergency stop"
    assert await other.ask("reset error") == "done"
    assert await client.ask(NEAR) == "done"
    await other.leaves()


@pytest.mark.requirement("FRC013", "FRC014", "FRC016")
async def test_the_queue_is_counted_a_move_cancelled_and_the_rest_cleared(client: Client) -> None:
    for reply in ("0", "1", "2"):
        assert await client.ask(FAR) == "done"
        assert await client.ask("get queue") == reply
    assert await client.ask("cancel move") == "done"
    assert int(await client.ask("get queue")) in (1, 2)  # the next one may already have begun
    assert await client.ask("get status") == "moving"
    assert await client.ask("clear queue") == "done"
    assert await client.ask("get queue") == "0"
    assert await client.ask("stop") == "done"
    await client.until_stopped()
    assert await client.ask("get error") == "0 none"


async def test_a_force_ends_a_force_move_and_the_log_says_where(
    simulator: Simulator, client: Client, caplog: pytest.LogCaptureFixture
) -> None:
    assert await client.ask("linforcez move : 450 200 520 0 -1.57079 0 0.1 0 5") == "done"
    await until(lambda: simulator.controller.tool_frame().y_mm > 5.0)
    simulator.controller.load.wrench = (0.0, 0.0, -6.5, 0.0, 0.0, 0.0)
    await client.until_stopped()
    x, y, z, *_ = [float(word) for word in (await client.ask("get tool frame")).split()]
    assert (x, z) == pytest.approx((450.0, 520.0), abs=0.5)
    assert 5.0 < y < 150.0
    assert await client.ask("get cartesian force") == "0.0 0.0 -6.5 0.0 0.0 0.0"
    (record,) = caplog.records
    assert record.levelname == "WARNING"
    assert "move 1 ends at a force of -6.500 N along z of the TCP" in record.getMessage()


@pytest.mark.parametrize("how", ["vanishes", "bye", "sends no more"])
async def test_a_client_that_goes_stops_the_robot_it_set_in_motion(
    simulator: Simulator, caplog: pytest.LogCaptureFixture, how: str
) -> None:
    client = await Client.connect(simulator.port)
    for _ in range(3):
        assert await client.ask(FAR) == "done"
    await until(lambda: simulator.controller.joints[0] > 0)
    if how == "leaves":
        await client.leaves()
    elif how == "vanishes":
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


async def test_a_client_that_only_looks_on_may_go(simulator: Simulator, client: Client) -> None:
    looker_on = await Client.connect(simulator.port)
    assert await client.ask(FAR) == "done"
    assert await looker_on.ask("get status") == "moving"
    looker_on.vanishes()
    await until(lambda: len(simulator._servers["iiwa"].connections) == 1)
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


SMART = "smart joint move : 0 0.5 0 -1 0 1.5 0 " + " ".join(["0.2"] * 7)
DIRECT = "direct cartesian move : {} 1"


@pytest.mark.requirement("FRA101", "FRA103", "FRA104")
async def test_modes_change_while_the_robot_moves(simulator: Simulator, client: Client) -> None:
    assert await client.ask("get mode") == "unknown"
    assert await client.ask(FAR) == "done"
    assert await client.ask("get mode") == "normal"
    await until(lambda: simulator.controller.joints[0] > 0.01)
    assert await client.ask(SMART) == "done"
    assert await client.ask("get mode") == "smart"
    assert await client.ask("get status") == "moving"
    await client.until_stopped()
    assert await client.ask("get joint position") == "0.0 0.5 0.0 -1.0 0.0 1.5 0.0"
    flange = await client.ask("get flange frame")
    assert await client.ask("direct joint move : 0.1 0.5 0 -1 0 1.5 0 " + "1 " * 7) == "error"
    assert await client.ask("get mode") == "smart"
    assert await client.ask(DIRECT.format(flange)) == "done"
    assert await client.ask("get mode") == "direct"
    assert await client.ask("stop") == "done"
    assert await client.ask("get mode") == "unknown"


@pytest.mark.requirement("FRA104")
async def test_smart_targets_are_followed_as_they_come(simulator: Simulator, client: Client) -> None:
    for k in range(50):
        j0 = 0.002 * k
        assert await client.ask(f"smart joint move : {j0} 0.5 0 -1 0 1.5 0 {'1 ' * 7}") == "done"
        assert await client.ask("get status") == "moving"
    await client.until_stopped()
    assert simulator.controller.joints == (0.002 * 49, 0.5, 0.0, -1.0, 0.0, 1.5, 0.0)


@pytest.mark.requirement("FRC021")
async def test_a_servo_mode_without_commands_ends_and_says_so(caplog: pytest.LogCaptureFixture) -> None:
    async with Simulator(servo_timeout_s=0.05) as simulator:
        client = await Client.connect(simulator.port)
        assert await client.ask("get error") == "0 none"
        assert await client.ask("smart joint move : 1 1 1 -1.5 1 1 1 " + "0.1 " * 7) == "done"
        await until(lambda: simulator.controller.mode is Mode.UNKNOWN)
        assert await client.ask("get mode") == "unknown"
        assert await client.ask("get error") == "3040 no smart command for 0.05 s: the robot stops"
        await client.until_stopped()
        assert simulator.controller.joints[0] < 0.5
        await client.leaves()
    (record,) = caplog.records
    assert record.levelno == logging.WARNING
    assert record.getMessage() == "no smart command for 0.05 s: the robot stops"


@pytest.mark.requirement("FRC021")
async def test_the_reason_of_a_refusal_can_be_asked_for(client: Client) -> None:
    assert await client.ask("joint move : 9 0 0 0 0 0 0 1 1 1 1 1 1 1") == "error"
    assert (await client.ask("get error")).startswith("3023 A1 at 9 rad is outside -2.96706 to 2.96706 rad")


async def test_after_the_context_nothing_listens_and_nothing_ticks() -> None:
    async with Simulator() as simulator:
        port = simulator.port
        client = await Client.connect(port)
        await until(lambda: simulator.controller.tick > 5)
    assert await client.rest() == b""
    with pytest.raises(ConnectionRefusedError):
        await Client.connect(port)
    tick = simulator.controller.tick
    async with Simulator() as second:  # as a measure of time
        await until(lambda: second.controller.tick > 5)
    assert simulator.controller.tick == tick
    await client.leaves()


async def test_a_port_in_use_is_told(simulator: Simulator) -> None:
    second = Simulator(port=simulator.port)
    with pytest.raises(ListenFault, match=f"^cannot listen on 127.0.0.1:{simulator.port}: "):
        await second.__aenter__()
    assert second.controller.tick == 0
