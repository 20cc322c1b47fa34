"""The dialogues of protocol/transcripts/krc4, played over a real socket in simulated time."""

from __future__ import annotations

import re

import pytest

from iiwa_sim.protocols.krc4_xml import load_krc4_table
from iiwa_sim.simulator import Simulator
from iiwa_sim.transcript.lines import Kind, Transcript, shipped
from iiwa_sim.transcript.replay import replay
from tests.simulated_time import SimulatedTime

TRANSCRIPTS = {transcript.name: transcript for transcript in shipped("krc4")}


@pytest.mark.requirement(
    "FRA005", "FRC003", "FRC004", "FRC005", "FRC011", "FRC016", "FRC019", "FRC021", "FRC022", "FRC023"
)
@pytest.mark.parametrize("name", TRANSCRIPTS)
def test_a_transcript_is_answered_as_it_says(name: str) -> None:
    assert deviations(TRANSCRIPTS[name]) == []


def test_every_message_is_carried_out_in_one_and_refused_in_one() -> None:
    answered = {
        int(found[1])
        for transcript in TRANSCRIPTS.values()
        for step in transcript.steps
        if step.kind in (Kind.EXACT, Kind.NUMBERS)
        if (found := re.search(r"I1(?:=|>)(-?\d+)", step.text))
    }
    ids = set(load_krc4_table())
    assert ids <= answered
    assert {-number for number in ids} <= answered


def deviations(transcript: Transcript) -> list[str]:
    """What is answered otherwise, by a robot whose time stands still but for the waits."""
    robot = transcript.robot or "kr_6_r900_sixx"
    with Simulator(robot, protocol=transcript.protocols, clock="stepped") as simulator:
        ports = list(simulator.ports.values())
        played = replay(transcript, simulator.host, ports, timeout_s=30, robot_time=SimulatedTime(simulator))
        return [f"{transcript.name}:{each.line}: {each}" for each in played]
