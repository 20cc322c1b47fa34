"""The dialogues of protocol/transcripts, replayed over a real socket in simulated time."""

from __future__ import annotations

import pytest

from iiwa_sim.protocols.table import load_table
from iiwa_sim.simulator import Simulator
from iiwa_sim.transcript.lines import shipped
from iiwa_sim.transcript.replay import replay
from tests.simulated_time import SimulatedTime

TRANSCRIPTS = {transcript.name: transcript for transcript in shipped()}


@pytest.mark.requirement(
    "FRC001",
    "FRC002",
    "FRC005",
    "FRC007",
    "FRC013",
    "FRC014",
    "FRC016",
    "FRC017",
    "FRC018",
    "FRC019",
    "FRC020",
    "FRC021",
    "FRC022",
    "FRC023",
    "FRC024",
    "FRC025",
    "FRC026",
)
@pytest.mark.parametrize("name", TRANSCRIPTS)
def test_a_transcript_is_answered_as_it_says(name: str) -> None:
    with Simulator(clock="stepped") as simulator:
        passing = SimulatedTime(simulator)
        played = replay(TRANSCRIPTS[name], simulator.host, simulator.port, timeout_s=30, robot_time=passing)
        assert [f"{name}:{each.line}: {each}" for each in played] == []


def test_every_command_is_in_one() -> None:
    said = set[str]().union(*(transcript.commands for transcript in TRANSCRIPTS.values()))
    assert set(load_table("iiwa").commands) <= said
