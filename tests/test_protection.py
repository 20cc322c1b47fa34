"""A robot that protects itself, as a driver and the status port see it."""

from __future__ import annotations

import re
import socket
from pathlib import Path

import pytest

from iiwa_sim import Iiwa, Simulator
from iiwa_sim.controller.errors import ErrorRecord
from iiwa_sim.transcript.lines import Kind, Transcript, shipped
from iiwa_sim.transcript.replay import replay
from tests.cell.cells import EXAMPLES
from tests.simulated_time import simulated_time
from tests.states import on_the_status_port
from tests.talking import DEADLINE_S

PROTECTED = EXAMPLES / "protected.toml"
TRANSCRIPTS = {transcript.name: transcript for transcript in shipped("protection")}
CAUSE = r"protective stop: collision: the external force at the TCP is [\d.]+ N, its threshold is 80 N"


def deviations(transcript: Transcript, cell: Path) -> list[str]:
    with Simulator(cell=cell, clock="stepped") as simulator:
        passing = simulated_time(simulator)
        played = replay(transcript, simulator.host, simulator.port, timeout_s=30, clock=passing)
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
    with Simulator(cell=PROTECTED, clock="stepped", status_port=0) as simulator:
        until_it_stops(simulator, "force.txt")
        (told,) = caplog.messages
        assert re.fullmatch(CAUSE, told), "the log"
        with Iiwa(simulator.host, simulator.port) as robot:
            assert robot.get_error() == (3060, told)
            status = robot.get_robot_status()
        assert (status.in_error, status.error_code, status.motion_possible) == (1, 3060, 0)
        seen = simulator.call(simulator.backdoor.state)
        assert (seen.error, seen.robot_status) == (ErrorRecord(3060, told), tuple(status))
        line = on_the_status_port(simulator)
        assert line["error"] == {"code": 3060, "reason": told}
        assert line["robot_status"] == list(status)
