"""The dialogues of protocol/transcripts, replayed over a real socket in simulated time."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from iiwa_sim.protocols.krc4_xml import TAGS
from iiwa_sim.protocols.table import load_table
from iiwa_sim.simulator import Simulator
from iiwa_sim.transcript.lines import Kind, shipped
from iiwa_sim.transcript.replay import replay
from tests.simulated_time import simulated_time

KRC4 = shipped("krc4")
TRANSCRIPTS = {transcript.name: transcript for transcript in shipped()}
ALL = TRANSCRIPTS | {f"{kind}/{each.name}": each for kind in ("krc4", "protection") for each in shipped(kind)}
PROTECTED = Path(__file__).parent.parent / "examples" / "protected.toml"
REQUIREMENTS = (1, 2, 3, 4, 5, 7, 11, 13, 14, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26)


@pytest.mark.requirement("FRA005", *(f"FRC{number:03}" for number in REQUIREMENTS))
@pytest.mark.parametrize("name", ALL)
def test_a_transcript_has_its_expected_replies(name: str) -> None:
    transcript = ALL[name]
    robot = transcript.robot or ("kr_6_r900_sixx" if name.startswith("krc4/") else None)
    cell = PROTECTED if name.startswith("protection/") else None
    with Simulator(robot, cell=cell, protocol=transcript.protocols, clock="stepped") as simulator:
        ports = list(simulator.ports.values())
        played = replay(transcript, simulator.host, ports, timeout_s=30, clock=simulated_time(simulator))
        assert [f"{name}:{each.line}: {each}" for each in played] == []


def test_every_command_is_in_a_transcript() -> None:
    commands = set[str]().union(*(transcript.commands for transcript in TRANSCRIPTS.values()))
    assert set(load_table("iiwa").commands) <= commands


def test_every_message_is_accepted_and_rejected_in_a_transcript() -> None:
    answered = {
        int(found[1])
        for step in (step for transcript in KRC4 for step in transcript.steps)
        if step.kind in (Kind.EXACT, Kind.NUMBERS) and (found := re.search(r"I1(?:=|>)(-?\d+)", step.text))
    }
    ids = set(TAGS)
    assert ids | {-number for number in ids} <= answered
