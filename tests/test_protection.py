"""A robot that protects itself, as a driver, ROS, the status port and the page see it."""

from __future__ import annotations

import html
import json
import re
import socket
from pathlib import Path
from typing import Any

import msgspec
import pytest
from websockets.sync.client import connect

from iiwa_sim import Iiwa, Simulator
from iiwa_sim.controller.state import ErrorState
from iiwa_sim.transcript.lines import Kind, Transcript, shipped
from iiwa_sim.transcript.replay import replay
from iiwa_sim.view.panel import figures
from iiwa_sim.view.scene import Robot
from tests.cell.cells import EXAMPLES
from tests.ros_robot import ptp
from tests.simulated_time import SimulatedTime
from tests.states import on_the_status_port
from tests.talking import DEADLINE_S

PROTECTED = EXAMPLES / "protected.toml"
TRANSCRIPTS = {transcript.name: transcript for transcript in shipped("protection")}
CAUSE = r"protective stop: collision: the external force at the TCP is [\d.]+ N, its threshold is 80 N"


def deviations(transcript: Transcript, cell: Path) -> list[str]:
    with Simulator(cell=cell, clock="stepped") as simulator:
        passing = SimulatedTime(simulator)
        played = replay(transcript, simulator.host, simulator.port, timeout_s=30, robot_time=passing)
        return [f"{transcript.name}:{each.line}: {each}" for each in played]


@pytest.mark.parametrize("name", TRANSCRIPTS)
def test_a_transcript_is_answered_as_it_says(name: str) -> None:
    assert deviations(TRANSCRIPTS[name], PROTECTED) == []


def until_it_stops(simulator: Simulator, name: str) -> None:
    """A driver says what it says in a transcript, up to the stop."""
    with socket.create_connection((simulator.host, simulator.port), DEADLINE_S) as driver:
        file = driver.makefile("rwb")
        for step in TRANSCRIPTS[name].steps:
            if step.kind is Kind.WAIT:
                simulator.run_until_stopped()
            elif step.kind is Kind.SAID:
                if step.text == "get error":
                    return
                file.write(f"{step.text}\r\n".encode())
                file.flush()
                assert not file.readline().startswith(b"error"), step.text


def test_it_shows_everywhere_the_error_is_told(caplog: pytest.LogCaptureFixture) -> None:
    with Simulator(cell=PROTECTED, clock="stepped", status_port=0, rosbridge_port=0) as simulator:
        until_it_stops(simulator, "force.txt")
        (told,) = caplog.messages
        assert re.fullmatch(CAUSE, told), "the log"
        with Iiwa(simulator.host, simulator.port) as robot:
            assert robot.get_error() == (3060, told)
            status = robot.get_robot_status()
        assert (status.in_error, status.error_code, status.motion_possible) == (1, 3060, 0)
        seen = simulator.call(simulator.backdoor.state)
        assert (seen.error, seen.robot_status) == (ErrorState(3060, told), tuple(status))
        line = on_the_status_port(simulator)
        assert line["error"] == {"code": 3060, "reason": told}
        assert line["robot_status"] == list(status)
        page = figures(line, msgspec.convert(simulator.cell.description, Robot, from_attributes=True))
        assert html.escape(f"3060 {told}") in page
        ros = on_ros(simulator)
    assert (ros["/robot_status"][-1]["in_error"], ros["/robot_status"][-1]["error_code"]) == (
        {"val": 1},
        3060,
    )
    (result,) = ros["/command_result"]
    assert (result["result_code"], told in result["additional_information"]) == (3060, True)
    (diagnosis,) = ros["/diagnostics"][-1]["status"]
    assert (diagnosis["level"], diagnosis["message"]) == (2, told)


def on_ros(simulator: Simulator) -> dict[str, list[Any]]:
    """The messages of some topics, in a second and more in which a move is sent."""
    url = f"ws://{simulator.host}:{simulator.rosbridge_port}"
    heard: dict[str, list[Any]] = {"/robot_status": [], "/command_result": [], "/diagnostics": []}
    with connect(url, open_timeout=DEADLINE_S, close_timeout=1.0) as ros:

        def says(operation: str, **fields: Any) -> None:
            ros.send(json.dumps({"op": operation, **fields}))

        def hears_all() -> None:
            """All that has been sent up to now."""
            says("call_service", service="/rosapi/nodes", id="now")
            while (message := json.loads(ros.recv(DEADLINE_S))).get("id") != "now":
                heard[message["topic"]].append(message["msg"])

        for topic in ("/robot_status", "/command_result"):
            says("subscribe", topic=topic, queue_length=100)
        says("subscribe", topic="/diagnostics", type="diagnostic_msgs/msg/DiagnosticArray")
        away = [0.3, 0.3, 0.0, -1.2, 0.0, 1.0, 0.0]
        says("publish", topic="/command_list", msg={"commands": [ptp(1, away)]})
        hears_all()
        simulator.advance(1.1)
        hears_all()
    return heard
