"""A robot behind a connection as an arm: what ROS 2's joint level can do by the text protocol alone."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Any

import pytest

from iiwa_sim.client import AsyncIiwa
from iiwa_sim.controller.errors import Refused
from iiwa_sim.robot.description import load_robot
from iiwa_sim.ros.arm.joint_level import COMMANDS, TRAJECTORY, TWIST, JointLevel
from iiwa_sim.ros.bridge.arm import RemoteArm
from iiwa_sim.simulator import Simulator
from tests.journal import Journal
from tests.talking import DEADLINE_S

HERE = (0.0, 0.523599, 0.0, -1.047198, 0.0, 1.570796, 0.0)


class Bench:
    """A joint level whose robot is remote, in rounds as the bridge makes them."""

    def __init__(self, simulator: Simulator) -> None:
        self.simulator = simulator
        self.client = AsyncIiwa("127.0.0.1", simulator.port, DEADLINE_S)
        self.robot = RemoteArm(self.client, load_robot())
        self.log = Journal(fails=True)
        self.now_ns = 0
        self.level = JointLevel(self.robot, lambda: self.now_ns, 100, self.log)

    async def goes_on(self, rounds: int = 1) -> None:
        for _ in range(rounds):
            await self.robot.do_asked()
            await self.robot.look()
            self.level.step()
            self.now_ns += 10_000_000
            await self.simulator.clock.advance(0.01)

    async def calls(self, service: str, **request: Any) -> Any:
        answers: list[Any] = []
        self.level.call(service, request, answers.append)
        await self.robot.do_asked()
        (answer,) = answers
        return answer


@pytest.fixture
async def bench() -> AsyncIterator[Bench]:
    async with Simulator(clock="stepped") as simulator:
        bench = Bench(simulator)
        async with bench.client:
            await bench.robot.look()
            yield bench


async def test_states_are_what_the_protocol_tells(bench: Bench) -> None:
    heard: dict[str, list[Any]] = {topic: [] for topic in bench.level.published}
    assert {"/clock", "/wrench"}.isdisjoint(heard)
    for topic, messages in heard.items():
        bench.level.listen(topic, messages.append)
    await bench.goes_on(2)
    state = heard["/robot_joint_states"][-1]
    assert state["position"] == pytest.approx(HERE, abs=1e-6)
    assert state["velocity"] == []
    assert [each["child_frame_id"] for each in heard["/tf"][-1]["transforms"]][-1] == "tool"
    tool = heard["/tf"][-1]["transforms"][-1]["transform"]["translation"]
    there = bench.simulator.controller.tool_in_flange.translation
    assert (tool["x"], tool["y"], tool["z"]) == pytest.approx(there, abs=1e-5)


async def test_commands_and_twists_become_direct_moves(bench: Bench) -> None:
    names = list(load_robot().joints)
    near = [HERE[0] + 0.05, *HERE[1:]]
    for part in (0.2, 0.6, 1.0):  # only the newest of them is sent
        told = {"name": names, "position": [HERE[0] + 0.05 * part, *HERE[1:]]}
        bench.level.receive(COMMANDS, told, "test")
    await bench.goes_on(100)
    assert bench.simulator.controller.joints == pytest.approx(near, abs=1e-6)
    assert bench.simulator.controller.status().in_error == 0
    before = bench.simulator.controller.tool_frame()
    for _ in range(30):
        twist = {"twist": {"linear": {"z": -0.05}}}
        bench.level.receive(TWIST, twist, "test")
        await bench.goes_on(2)
    await bench.goes_on(60)
    after = bench.simulator.controller.tool_frame()
    assert not bench.simulator.controller.moving
    assert after[2] - before[2] == pytest.approx(-37.0, abs=9.0), (
        "mm in 0.6 s and what it takes to come to rest"
    )
    assert after[:2] == pytest.approx(before[:2], abs=1.0)


async def test_a_refused_command_moves_nothing(bench: Bench, caplog: pytest.LogCaptureFixture) -> None:
    told = {"name": list(load_robot().joints), "position": [0.5] * 7}
    bench.level.receive(COMMANDS, told, "test")
    await bench.goes_on(5)
    assert bench.simulator.controller.joints == pytest.approx(HERE, abs=1e-6)
    assert "a direct move goes 0.087 rad at most" in caplog.text


async def test_there_are_no_trajectories_and_that_is_told(bench: Bench) -> None:
    points = [{"positions": list(HERE), "time_from_start": {"sec": 1, "nanosec": 0}}]
    trajectory = {"joint_names": list(load_robot().joints), "points": points}
    with pytest.raises(Refused, match="the text protocol has none"):
        bench.level.receive(TRAJECTORY, trajectory, "test")
    with pytest.raises(Refused, match="the text protocol has none"):
        bench.level.send_goal({"trajectory": trajectory}, lambda _: None, None, "test")


async def test_services_do_what_the_protocol_has(bench: Bench) -> None:
    controller = bench.simulator.controller
    assert await bench.calls("/set_output_2", data=True) == {"success": True, "message": ""}
    assert controller.io.outputs[1]
    bench.level.receive("/set_speed_scale", {"data": 0.5}, "test")
    await bench.goes_on()
    assert controller.override == 0.5
    assert await bench.calls("/stop") == {"success": True, "message": ""}
    refused = await bench.calls("/emergency_stop", data=True)
    assert refused == {
        "success": False,
        "message": "the text protocol has no emergency stop: /stop stops the robot",
    }
    controller.emergency_stop()
    controller.release_emergency_stop()
    assert await bench.calls("/reset_error") == {"success": True, "message": ""}
    assert controller.status().in_error == 0


async def test_while_there_is_no_connection_nothing_is_told_and_calls_fail(bench: Bench) -> None:
    heard: list[Any] = []
    bench.level.listen("/robot_joint_states", heard.append)
    bench.robot.give_up("no connection to the robot: it has gone")
    bench.level.step()
    assert heard == []
    answer = await bench.calls("/stop")
    assert answer == {"success": False, "message": "no connection to the robot: it has gone"}
    async with asyncio.timeout(DEADLINE_S):
        await bench.goes_on(2)
    assert heard, "it is back"
