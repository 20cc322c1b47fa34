"""A robot behind a connection on ROS: our own server, and one with the commands of Appendix B only."""

from __future__ import annotations

import asyncio
import contextlib
import json
import signal
from collections.abc import AsyncIterator
from typing import Any

import pytest
from websockets.asyncio.client import connect as async_connect
from websockets.sync.client import connect

from iiwa_sim.client import AsyncIiwa
from iiwa_sim.dialect.wire.table_file import load_table
from iiwa_sim.robot.description import load_robot
from iiwa_sim.ros.bridge.bridge import RECONNECT_S, Bridge
from iiwa_sim.ros.bridge.remote import RemoteRobot
from iiwa_sim.ros.conventions import RosOptions
from iiwa_sim.ros.fault import BridgeFault
from iiwa_sim.ros.rmi.node import Node
from iiwa_sim.simulator import Simulator
from tests.journal import Journal
from tests.processes import IIWA_SIM, running, started
from tests.ros_robot import command, ptp
from tests.talking import DEADLINE_S, Client, until

A = [0.3, 0.3, 0.0, -1.2, 0.0, 1.3, 0.0]
B = [0.0, 0.5, 0.0, -1.2, 0.0, 1.3, 0.0]
EXTENSIONS = {name for name, row in load_table("iiwa").commands.items() if row.extension}


class Bench:
    """A node whose robot is remote, in rounds as the bridge makes them."""

    def __init__(self, port: int) -> None:
        self.client = AsyncIiwa("127.0.0.1", port, DEADLINE_S)
        self.robot = RemoteRobot(self.client, load_robot())
        self.log = Journal(fails=True)
        self.node = Node(self.robot, lambda: 0, 100, self.log)
        self.results: list[dict[str, Any]] = []
        self.node.listen("/command_result", self.results.append)

    async def goes_on(self) -> None:
        await self.robot.do_asked()
        await self.robot.look()
        self.node.step()

    async def until_results(self, count: int) -> list[tuple[int, int]]:
        async with asyncio.timeout(DEADLINE_S):
            while len(self.results) < count:
                await self.goes_on()
        return [(result["command_id"], result["result_code"]) for result in self.results]

    def gets(self, *commands: dict[str, Any], replace: bool = False) -> None:
        self.node.receive("/command_list", {"commands": commands, "replace_previous_commands": replace})

    async def calls(self, service: str, **request: Any) -> Any:
        answers: list[Any] = []
        self.node.call(service, request, answers.append, answers.append)
        await self.robot.do_asked()
        assert len(answers) == 1
        return answers[0]


@pytest.fixture
async def simulator(request: pytest.FixtureRequest) -> AsyncIterator[Simulator]:
    async with Simulator(clock=getattr(request, "param", "fast")) as simulator:
        yield simulator


@pytest.fixture
async def bench(simulator: Simulator) -> AsyncIterator[Bench]:
    bench = Bench(simulator.port)
    async with bench.client:
        await bench.robot.look()
        yield bench


@pytest.fixture
async def plain(simulator: Simulator) -> AsyncIterator[Bench]:
    """One with a server that knows no extension."""

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        robot = await Client.connect(simulator.port)
        with contextlib.suppress(asyncio.IncompleteReadError, ConnectionError):
            while True:
                line = (await reader.readuntil(b"\r\n")).decode().strip()
                known = line.partition(":")[0].strip() not in EXTENSIONS
                writer.write((await robot.ask(line) if known else "unknown command").encode() + b"\r\n")
        await robot.leaves()
        writer.close()

    server = await asyncio.start_server(serve, "127.0.0.1", 0)
    bench = Bench(server.sockets[0].getsockname()[1])
    async with bench.client:
        await bench.robot.look()
        yield bench
    server.close()


@pytest.mark.requirement("FRA002", "FRA005")
async def test_results_come_in_order_as_moves_end(bench: Bench, simulator: Simulator) -> None:
    bench.gets(
        ptp(1, A),
        command(
            2,
            "LIN",
            "EULER_INTRINSIC_ZYX",
            [0.5, 0.3, 0.5, 0.0, 3.1, 0.0],
            blending_type="M",
            blending=[0.05],
        ),
        command(3, "LIN", "QUATERNION", [0.6, 0.2, 0.4, 0.0, 1.0, 0.0, 0.0]),
        command(4, "SMART", "JOINTS", B, velocity_type="RAD/S", velocity=[1.0]),
        ptp(5, A, velocity=[0.0]),
        ptp(6, A),
    )
    assert await bench.until_results(6) == [(1, 0), (2, 0), (3, 0), (4, 0), (5, 3000), (6, 3000)]
    assert simulator.controller.joints == pytest.approx(B)
    state = bench.robot.state
    assert state is not None
    assert state.joints == pytest.approx(B, abs=1e-8)
    assert bench.robot.status == simulator.controller.status()


async def test_a_refusal_has_the_robots_own_code_and_reason(bench: Bench) -> None:
    bench.gets(ptp(1, [9.0, *A[1:]]))
    assert await bench.until_results(1) == [(1, 3023)]
    assert bench.results[0]["additional_information"].startswith("A1 at 9 rad is outside")


async def test_services(bench: Bench, simulator: Simulator) -> None:
    assert await bench.calls("/scale_speed", value=0.5) == {}
    assert simulator.controller.override == 0.5
    assert await bench.calls("/set_io", number=5, value=True) == {"error": 0}
    assert await bench.calls("/get_io", number=5) == {"value": True, "error": 0}
    assert await bench.calls("/set_io", number=17, value=True) == {"error": 2}
    assert await bench.calls("/get_io", number=99) == {"value": False, "error": 1}


@pytest.mark.parametrize("simulator", ["real"], indirect=True)  # it must still move when it is stopped
async def test_stop_robot_right_now(bench: Bench, simulator: Simulator) -> None:
    bench.gets(ptp(1, A, velocity=[0.05]), ptp(2, B))
    async with asyncio.timeout(DEADLINE_S):
        while not simulator.controller.moving:
            await bench.goes_on()
    assert await bench.calls("/stop_robot_right_now") == {"success": True, "message": ""}
    assert await bench.until_results(2) == [(1, 3060), (2, 3060)]
    bench.gets(ptp(3, B))
    assert (await bench.until_results(3))[2] == (3, 0)


@pytest.mark.parametrize("simulator", ["real"], indirect=True)  # it must still move when it is stopped
async def test_a_robot_stopped_by_others_stands_short_of_its_target(
    bench: Bench, simulator: Simulator
) -> None:
    bench.gets(ptp(1, A, velocity=[0.05]), ptp(2, B))
    async with asyncio.timeout(DEADLINE_S):
        while not simulator.controller.moving:
            await bench.goes_on()
    simulator.controller.stop()
    assert await bench.until_results(2) == [(1, 3060), (2, 3060)]
    assert "short of the target" in bench.results[0]["additional_information"]


@pytest.mark.parametrize("simulator", ["real"], indirect=True)
async def test_an_error_of_the_robot_is_the_result(bench: Bench, simulator: Simulator) -> None:
    bench.gets(ptp(1, A, velocity=[0.05]))
    async with asyncio.timeout(DEADLINE_S):
        while not simulator.controller.moving:
            await bench.goes_on()
    simulator.controller.emergency_stop()
    assert await bench.until_results(1) == [(1, 3030)]


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ({"velocity_type": "M/S", "velocity": [0.1]}, "this robot takes %"),
        ({"blending_type": "%", "blending": [0.1]}, "this robot takes M"),
    ],
)
async def test_what_the_protocol_cannot_say_is_refused(
    bench: Bench, what: dict[str, Any], words: str
) -> None:
    bench.gets(command(1, "LIN", "EULER_INTRINSIC_ZYX", [0.5, 0.3, 0.5, 0.0, 3.1, 0.0], **what))
    assert await bench.until_results(1) == [(1, 3000)]
    assert words in bench.results[0]["additional_information"]


async def test_joint_moves_stop_blend_over_a_tenth_or_are_refused(bench: Bench) -> None:
    bench.gets(ptp(1, A, blending_type="%", blending=[0.1]), ptp(2, B, blending_type="%", blending=[0.2]))
    assert await bench.until_results(2) == [(1, 0), (2, 3000)]
    assert "the tenth it always has" in bench.results[1]["additional_information"]


async def test_a_server_without_extensions_drives_all_the_same(plain: Bench, simulator: Simulator) -> None:
    euler = [0.5, 0.3, 0.5, 0.0, 3.1, 0.0]
    forces = {"effort_type": "N", "effort": [10.0, 10.0, 10.0]}
    plain.gets(
        ptp(1, A),
        command(2, "LIN", "EULER_INTRINSIC_ZYX", euler),
        command(3, "PTPFORCE", "QUATERNION", [0.6, 0.2, 0.4, 0.0, 1.0, 0.0, 0.0], **forces),
        ptp(4, [9.0, *A[1:]]),
    )
    assert await plain.until_results(4) == [(1, 0), (2, 0), (3, 0), (4, 3000)]
    assert plain.results[3]["additional_information"] == "refused, the robot says no more"
    plain.gets(command(5, "LIN", "JOINTS", A))
    await plain.until_results(5)
    assert "does not know this command" in plain.results[4]["additional_information"]
    plain.gets(command(6, "SMART", "EULER_INTRINSIC_ZYX", [0.6, 0.2, 0.5, 0.0, 3.1416, 0.0]))
    assert (await plain.until_results(6))[5] == (6, 0)
    assert simulator.controller.mode.value == "smart"


async def test_a_server_without_extensions_says_what_it_does_not_know(plain: Bench) -> None:
    assert await plain.calls("/get_io", number=1) == {"value": False, "error": -1}
    assert await plain.calls("/set_io", number=1, value=True) == {"error": -1}
    assert await plain.calls("/scale_speed", value=0.5) == "the robot does not know this command"
    assert (await plain.calls("/robot/get_digital_ios"))["success"] is False
    assert (await plain.calls("/stop_robot_right_now"))["success"] is True
    state = plain.robot.state
    assert state is not None
    assert state.override is None
    assert plain.robot.status is not None
    assert plain.robot.status.in_motion == 0
    assert plain.robot.status.e_stopped == -1


async def test_a_connection_that_fails_is_told_and_opened_again(caplog: pytest.LogCaptureFixture) -> None:
    async with Simulator() as first:
        port = first.port
        async with Bridge(("127.0.0.1", port), load_robot(), RosOptions("127.0.0.1", 0)) as bridge:
            results: list[dict[str, Any]] = []
            bridge._ros._node.listen("/command_result", results.append)
            slow = ptp(1, A, velocity=[0.01])
            bridge._ros._node.receive("/command_list", {"commands": [slow]})
            await until(lambda: first.controller.moving)
            await first.__aexit__(None, None, None)
            await until(lambda: bool(results))
            assert results[0]["result_code"] == 3040
            assert "the connection to the robot failed" in caplog.text
            heard: dict[str, list[dict[str, Any]]] = {"/robot_status": [], "/joint_states": []}
            for topic, messages in heard.items():
                bridge._ros._node.listen(topic, messages.append)
            await until(lambda: len(heard["/robot_status"]) > 2)
            assert {
                name: value for name, value in heard["/robot_status"][-1].items() if name != "header"
            } == {
                **{name: {"val": -1} for name in ("mode", "e_stopped", "drives_powered", "in_motion")},
                "motion_possible": {"val": 0},
                "in_error": {"val": 1},
                "error_code": 3040,
            }
            assert not heard["/joint_states"], "where the robot is, nobody knows"
            failed: list[Any] = []
            bridge._ros._node.call("/stop_robot_right_now", {}, failed.append, failed.append)
            await until(lambda: bool(failed))
            assert failed[0]["success"] is False
            async with Simulator(port=port) as second:
                await until(lambda: bool(heard["/joint_states"]))
                heard["/robot_status"].clear()
                await until(lambda: bool(heard["/robot_status"]))
                assert heard["/robot_status"][0]["in_error"] == {"val": 0}
                bridge._ros._node.receive("/command_list", {"commands": [ptp(2, A)]})
                await until(lambda: len(results) == 2)
                assert results[1]["result_code"] == 0
                assert second.controller.joints == pytest.approx(A)
                assert "connected to the robot again" in caplog.text


async def test_what_comes_while_there_is_no_connection_fails_and_is_not_made_up_for() -> None:
    first = Simulator()
    await first.__aenter__()
    port = first.port
    async with Bridge(("127.0.0.1", port), load_robot(), RosOptions("127.0.0.1", 0)) as bridge:
        results: list[dict[str, Any]] = []
        bridge._ros._node.listen("/command_result", results.append)
        await first.__aexit__(None, None, None)
        await until(lambda: bridge._robot.state is None)
        url = f"ws://127.0.0.1:{bridge.rosbridge_address[1]}" if bridge.rosbridge_address else ""
        async with async_connect(url, open_timeout=DEADLINE_S) as ros:
            lists = {"commands": [ptp(1, A), ptp(2, B)]}
            await ros.send(json.dumps({"op": "publish", "topic": "/command_list", "msg": lists}))
            await until(lambda: len(results) == 2)
        assert [(result["command_id"], result["result_code"]) for result in results] == [(1, 3040), (2, 3040)]
        assert results[0]["additional_information"].startswith("no connection to the robot: ")
        async with Simulator(port=port) as second:
            await until(lambda: bridge._robot.state is not None)
            bridge._ros._node.receive("/command_list", {"commands": [ptp(3, A)]})
            await until(lambda: len(results) == 3)
            assert results[2]["result_code"] == 0
            assert second.controller.joints == pytest.approx(A), "the newest, and nothing from before"


async def test_who_accepts_connections_and_ends_them_is_asked_once_a_second(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """As a forwarded port does whose server is down."""
    waits: list[float] = []
    sleep = asyncio.sleep

    async def counted(delay: float) -> None:
        waits.append(delay)
        await sleep(0)

    monkeypatch.setattr("iiwa_sim.ros.bridge.bridge.asyncio.sleep", counted)
    connections = 0

    async def serve(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        nonlocal connections
        connections += 1
        writer.close()

    async with Simulator() as simulator:
        port = simulator.port
        bridge = Bridge(("127.0.0.1", port), load_robot(), RosOptions("127.0.0.1", 0))
        await bridge.__aenter__()
    server = await asyncio.start_server(serve, "127.0.0.1", port)
    await until(lambda: connections >= 20)
    await bridge.__aexit__(None, None, None)
    server.close()
    assert waits.count(RECONNECT_S) >= connections - 1
    assert caplog.text.count("the connection to the robot failed") == 1


async def test_a_robot_with_other_joints_is_not_taken_for_this_one(simulator: Simulator) -> None:
    robot = load_robot("kr_6_r900_sixx")
    bridge = Bridge(("127.0.0.1", simulator.port), robot, RosOptions("127.0.0.1", 0))
    with pytest.raises(BridgeFault, match="it has 7 joints, KR 6 R900 sixx, as which it is bridged, has 6"):
        await bridge.__aenter__()


async def test_without_a_robot_one_line_says_so() -> None:
    with pytest.raises(BridgeFault, match=r"^no robot at 127\.0\.0\.1:1: Connection refused$"):
        await Bridge(("127.0.0.1", 1), load_robot(), RosOptions("127.0.0.1", 0)).__aenter__()


def test_as_a_process() -> None:
    with running() as robot:
        command = (*IIWA_SIM, "bridge", f"127.0.0.1:{robot.port}", "--rosbridge-port", "0")
        with started(*command) as bridge:
            said, _, port = bridge.line().strip().rpartition(":")
            assert said == "rosbridge on 127.0.0.1"
            with connect(f"ws://127.0.0.1:{port}", open_timeout=DEADLINE_S) as ros:
                ros.send(json.dumps({"op": "subscribe", "topic": "/joint_states"}))
                state = json.loads(ros.recv(DEADLINE_S))["msg"]
                assert state["position"][3] == pytest.approx(-1.0472, abs=1e-4)
            assert bridge.ends(signal.SIGTERM) == (0, "")
