"""The dialogues of protocol/transcripts/krc4, played over a real socket in simulated time."""

from __future__ import annotations

import re
from importlib.resources import files

import pytest

from iiwa_sim.dialect.krc4.table import load_krc4_table
from iiwa_sim.simulator import Simulator
from iiwa_sim.transcript.lines import Answered, Compare, Transcript, read, shipped
from iiwa_sim.transcript.replay import replay
from tests.simulated_time import SimulatedTime

TRANSCRIPTS = {transcript.name: transcript for transcript in shipped("krc4")}


@pytest.mark.requirement(
    "FRA005", "FRC003", "FRC004", "FRC005", "FRC011", "FRC016", "FRC019", "FRC021", "FRC022", "FRC023"
)
@pytest.mark.parametrize("name", TRANSCRIPTS)
def test_a_transcript_is_answered_as_it_says(name: str) -> None:
    assert deviations(TRANSCRIPTS[name]) == []


@pytest.mark.parametrize("robot", ["lbr_iiwa_14_r820"])
@pytest.mark.parametrize("name", [name for name, each in TRANSCRIPTS.items() if not each.robot])
def test_one_that_names_no_robot_holds_for_any(name: str, robot: str) -> None:
    assert deviations(TRANSCRIPTS[name]._replace(robot=robot)) == []


@pytest.mark.parametrize(
    ("reply", "other", "told"),
    [
        (
            "< Res I0=4 I1=100\n",
            "< Res I0=4 I1=100 I2=1\n",
            "'Cmd I0=4 I1=100': expected 'Res I0=4 I1=100 I2=1', got 'Res I0=4 I1=100'",
        ),
        ("R1=20.0 R2=800.0", "R1=20.0 R2=800.002", "'Cmd I0=6 I1=310': R2 is 800.0, expected 800.002 within"),
    ],
)
def test_one_that_says_otherwise_deviates_in_one_line(reply: str, other: str, told: str) -> None:
    text = files("iiwa_sim.protocol").joinpath("transcripts", "krc4", "moves.txt").read_text("utf-8")
    assert reply in text
    changed = read("changed.txt", text.replace(reply, other, 1))
    (found,) = deviations(changed)
    line = text[: text.index(reply)].count("\n") + 1
    assert found.startswith(f"changed.txt:{line}: {told}")


def test_every_message_is_carried_out_in_one_and_refused_in_one() -> None:
    answered = {
        int(found[1])
        for transcript in TRANSCRIPTS.values()
        for step in transcript.steps
        if isinstance(step, Answered) and step.compare is not Compare.ANY
        if (found := re.search(r"I1(?:=|>)(-?\d+)", step.text))
    }
    ids = set(load_krc4_table().commands)
    assert ids <= answered
    assert {-number for number in ids} <= answered


def deviations(transcript: Transcript) -> list[str]:
    """What is answered otherwise, by a robot whose time stands still but for the waits."""
    robot = transcript.robot or "kr_6_r900_sixx"
    with Simulator(robot, dialects=transcript.dialects, clock="stepped") as simulator:
        ports = list(simulator.ports.values())
        played = replay(transcript, simulator.host, ports, timeout_s=30, robot_time=SimulatedTime(simulator))
        return [f"{transcript.name}:{each.line}: {each}" for each in played]
