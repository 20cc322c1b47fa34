"""A simulator on rosbridge, over real sockets: with the clients that people use, and with bad ones."""

from __future__ import annotations

import asyncio
import contextlib
import fcntl
import json
import re
import shutil
import subprocess
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from benchmarks.floods import operation, websockets
from iiwa_sim.ros.rosbridge_server import LONGEST_FRAME_BYTES
from iiwa_sim.simulator import Simulator
from iiwa_sim.wording import Unusable
from tests.line_client import DEADLINE_S, Client
from tests.peers import lacks, program
from tests.processes import succeeds
from tests.ros_robot import ptp

EXAMPLES = Path(__file__).parent.parent / "examples"
TOO_BIG = 1009
A = [0.3, 0.3, 0.0, -1.2, 0.0, 1.0, 0.0]
B = [0.6, 0.5, 0.0, -1.2, 0.0, 1.0, 0.0]


class Ros:
    """A client that speaks JSON by hand."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection

    async def performs(self, name: str, **fields: Any) -> None:
        await self.connection.send(json.dumps({"op": name, **fields}))

    async def receives(self) -> dict[str, Any]:
        async with asyncio.timeout(DEADLINE_S):
            message: dict[str, Any] = json.loads(await self.connection.recv())
        return message

    async def calls(self, service: str, **args: Any) -> dict[str, Any]:
        """Call a service; return the response, without messages before it."""
        await self.performs("call_service", service=service, args=args, id="call")
        while (message := await self.receives()).get("id") != "call":
            pass
        return message


@asynccontextmanager
async def client_of(simulator: Simulator, path: str = "/") -> AsyncIterator[Ros]:
    assert simulator.rosbridge_port is not None
    url = f"ws://127.0.0.1:{simulator.rosbridge_port}{path}"
    async with connect(url, open_timeout=DEADLINE_S, close_timeout=1.0) as connection:
        yield Ros(connection)


@pytest.fixture
async def simulator() -> AsyncIterator[Simulator]:
    async with Simulator(rosbridge_port=0) as simulator:
        yield simulator


@pytest.fixture
async def ros(simulator: Simulator) -> AsyncIterator[Ros]:
    async with client_of(simulator, "/dnb-rosbridge") as ros:
        yield ros


@pytest.mark.requirement("FRA001", "FRA002", "FRA005", "FRC015")
def test_roslibpy_drives_the_robot() -> None:
    with Simulator(rosbridge_port=0) as simulator:
        printed = succeeds(
            [sys.executable, str(EXAMPLES / "ros_roslibpy.py"), "127.0.0.1", str(simulator.rosbridge_port)]
        )
    at, *results, scale, set_io, get_io, stop, set_ios, get_ios = printed.splitlines()
    assert at.startswith("at [0.0, 0.52")
    assert results[:3] == ["command 1 -> 0 ", "command 2 -> 0 ", "command 3 -> 0 "]
    assert results[3].startswith("command 4 -> 3000 command_type 'CIRC'")
    assert scale.endswith("-> {}")
    assert set_io.endswith("-> {'error': 0}")
    assert get_io.endswith("-> {'value': True, 'error': 0}")
    assert stop.endswith("-> {'success': True, 'message': ''}")
    assert set_ios.endswith("-> {'success': True, 'errors': []}")
    assert "'id': {'group_id': 'DO', 'pin_number': 6}, 'value': True, 'stamp':" in get_ios


@pytest.mark.slow
def test_roslibpy_sends_goals_as_on_ros_2() -> None:
    with Simulator(rosbridge_port=0) as simulator:
        simulator.backdoor.place([0.4, 0.3, 0.0, -1.7, -2.3, 0.6, 2.4])  # about where ros_roslibpy.py ends
        printed = succeeds(
            [sys.executable, str(EXAMPLES / "ros2_roslibpy.py"), "127.0.0.1", str(simulator.rosbridge_port)]
        )
    at, moving, reached, cancelled, rejected = printed.splitlines()
    assert at.startswith("at [0.4, 0.3")
    assert at.endswith("['nanosec', 'sec']")
    assert re.match(r"joint A1 is -?0\.", moving)
    assert "SUCCEEDED" in reached
    assert "'error_code': 0" in reached
    assert "CANCELED" in cancelled
    assert "Action goal was rejected: " in rejected
    assert "A6 at" in rejected


@pytest.fixture
def roslibjs(pytestconfig: pytest.Config) -> Path:
    """A folder with the package roslib in it, which stays for the next run."""
    npm, _ = program("npm"), program("node")
    folder = pytestconfig.cache.mkdir("roslibjs")
    with (folder.parent / "roslibjs.lock").open("w") as lock:  # of all workers one installs it
        fcntl.flock(lock, fcntl.LOCK_EX)
        there = folder / "roslib-2-is-there"
        if not there.exists():
            install = [npm, "install", "--prefix", str(folder), "--no-audit", "--no-fund", "roslib@2"]
            got = subprocess.run(
                install, capture_output=True, text=True, timeout=10 * DEADLINE_S, check=False
            )
            if got.returncode:
                lacks(f"roslib of npm ({got.stderr[-400:]})")
            there.touch()
    return folder


@pytest.mark.slow
@pytest.mark.requirement("FRA002", "FRA005")
def test_roslibjs_drives_the_robot(roslibjs: Path) -> None:
    script = shutil.copy(EXAMPLES / "ros_roslibjs.mjs", roslibjs)
    with Simulator(rosbridge_port=0) as simulator:
        printed = succeeds(["node", str(script), f"ws://127.0.0.1:{simulator.rosbridge_port}/dnb-rosbridge"])
    assert printed.splitlines() == [
        "command 1 -> 0 ",
        "command 2 -> 0 ",
        "command 3 -> 3000 command_type 'CIRC': expected one of LIN, PTP, SMART, DIRECT, LINFORCE, PTPFORCE",
        "at 0.000,0.500,0.000,-1.200,0.000,1.300,0.000",
        "/scale_speed {}",
        '/set_io {"error":2}',
        '/stop_robot_right_now {"success":true,"message":""}',
        "/nothing failed: there is no /nothing",
    ]


@pytest.mark.slow
def test_roslibjs_sends_goals_as_on_ros_2(roslibjs: Path) -> None:
    script = shutil.copy(EXAMPLES / "ros2_roslibjs.mjs", roslibjs)
    with Simulator(rosbridge_port=0) as simulator:
        printed = succeeds(["node", str(script), f"ws://127.0.0.1:{simulator.rosbridge_port}"])
    *lines, rejected, kind, stamp = printed.splitlines()
    cancelled = 'GoalError: Action was canceled: {"error_code":0,"error_string":"cancelled"}'
    assert lines == [
        "action /joint_trajectory_controller/follow_joint_trajectory",
        "feedback of A1 A2 A3 A4 A5 A6 A7",
        "reached, 0",
        cancelled,
        cancelled,
    ]
    assert "Action goal was rejected: after " in rejected
    assert (kind, stamp) == ("type sensor_msgs/msg/JointState", "stamp sec nanosec")


@pytest.mark.slow
async def test_roslibjs_lists_topics_and_actions(simulator: Simulator, roslibjs: Path) -> None:
    script = roslibjs / "asks.mjs"
    script.write_text("""
        import { Ros, Topic } from "roslib";
        const ros = new Ros({ url: process.argv[2] });
        const promised = (ask) => new Promise((done, failed) => ask(done, failed));
        await promised((done) => ros.on("connection", done));
        const { topics, types } = await promised((...then) => ros.getTopics(...then));
        const name = topics[types.indexOf("sensor_msgs/JointState")];
        const topic = new Topic({ ros, name, compression: "cbor" });
        const { position } = await promised((done) => topic.subscribe(done));
        console.log(name, position.length);
        console.log((await promised((...then) => ros.getActionServers(...then))).length);
        ros.close();
    """)
    url = f"ws://127.0.0.1:{simulator.rosbridge_port}"
    node = await asyncio.create_subprocess_exec(
        "node", str(script), url, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    async with asyncio.timeout(DEADLINE_S):
        printed, faults = await node.communicate()
    assert node.returncode == 0, faults
    assert printed.decode().splitlines() == ["/joint_states 7", "1"]


async def test_telnet_and_ros_share_the_robot(simulator: Simulator, ros: Ros) -> None:
    await ros.performs("subscribe", topic="/command_result")
    await ros.performs("publish", topic="/command_list", msg={"commands": [ptp(1, A), ptp(2, B)]})
    telnet = await Client.connect(simulator.port)
    while await telnet.ask("get status") != "moving":
        pass
    assert await telnet.ask("stop") == "done"
    results = [(await ros.receives())["msg"] for _ in range(2)]
    assert [(result["command_id"], result["result_code"]) for result in results] == [(1, 3060), (2, 3060)]
    assert results[0]["additional_information"] == "stopped"
    await telnet.leaves()


async def test_a_client_that_disconnects_does_not_stop_the_robot(simulator: Simulator) -> None:
    async with client_of(simulator) as ros:
        slow = ptp(1, B, velocity=[0.2])  # so that the other one is there in time
        await ros.performs("publish", topic="/command_list", msg={"commands": [slow]})
        assert (await ros.calls("/rosapi/nodes"))["result"] is True
    async with client_of(simulator) as other:
        await other.performs("subscribe", topic="/command_result")
        assert (await other.receives())["msg"]["result_code"] == 0
    assert simulator.controller.joints == pytest.approx(B)


async def test_a_huge_frame_ends_its_connection_only(simulator: Simulator, ros: Ros) -> None:
    async with client_of(simulator) as huge:
        with contextlib.suppress(ConnectionClosed):  # perhaps while it is being sent
            await huge.connection.send("x" * (LONGEST_FRAME_BYTES + 1))
        with pytest.raises(ConnectionClosed) as closed:
            await huge.receives()
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == TOO_BIG
    assert (await ros.calls("/rosapi/nodes"))["result"] is True


async def test_a_client_that_does_not_read_replies_is_read_no_further(simulator: Simulator, ros: Ros) -> None:
    (connection,) = await asyncio.to_thread(websockets, ("127.0.0.1", simulator.rosbridge_port), 1)
    question = operation("call_service", service="/rosapi/services")

    def blocks() -> bool:
        connection.settimeout(0.5)
        try:
            for _ in range(1_000_000):
                connection.sendall(question)
        except TimeoutError:
            return True
        return False

    assert await asyncio.to_thread(blocks)
    assert (await ros.calls("/rosapi/nodes"))["result"] is True
    connection.close()


async def test_after_the_context_nothing_listens_and_clients_are_closed() -> None:
    async with Simulator(rosbridge_port=0) as simulator:
        port = simulator.rosbridge_port
        connection = await connect(f"ws://127.0.0.1:{port}", open_timeout=DEADLINE_S)
    with pytest.raises(ConnectionClosed):
        await Ros(connection).receives()
    with pytest.raises(ConnectionRefusedError):
        await connect(f"ws://127.0.0.1:{port}", open_timeout=DEADLINE_S)


def test_without_a_library_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "websockets", None)
    with pytest.raises(Unusable, match=r"this needs websockets: .* -m pip install"):
        Simulator(rosbridge_port=0)
