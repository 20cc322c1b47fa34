"""The dialogues of protocol/transcripts/krc4, played over a real socket."""

from __future__ import annotations

from importlib.resources import files

import pytest

from iiwa_sim.dialect.krc4_table import load_krc4_table
from iiwa_sim.simulator import Simulator
from iiwa_sim.transcript.compare import deviation
from iiwa_sim.transcript.lines import (
    Answered,
    Compare,
    Connects,
    Leaves,
    Said,
    Transcript,
    Wait,
    read,
    wire_bytes,
)
from tests.krc4_talking import Krc4Client, replies

FOLDER = files("iiwa_sim.protocol").joinpath("transcripts", "krc4")
TRANSCRIPTS = {each.name: read(each.name, each.read_text("utf-8")) for each in FOLDER.iterdir()}


@pytest.mark.requirement(
    "FRA005", "FRC003", "FRC004", "FRC005", "FRC011", "FRC016", "FRC019", "FRC021", "FRC022", "FRC023"
)
@pytest.mark.parametrize("name", TRANSCRIPTS)
def test_a_transcript_is_answered_as_it_says(name: str) -> None:
    transcript = TRANSCRIPTS[name]
    with Simulator(transcript.robot, dialects=["krc4"], clock="stepped") as simulator:
        assert deviations(transcript, simulator) == []


@pytest.mark.parametrize(
    ("reply", "other"),
    [
        ("< <Res><I0>4</I0><I1>100</I1><I2>0</I2>", "< <Res><I0>4</I0><I1>100</I1><I2>1</I2>"),
        ("<R1>20.0</R1><R2>800.0</R2>", "<R1>20.0</R1><R2>800.002</R2>"),
    ],
)
def test_one_that_says_otherwise_deviates_in_one_line(reply: str, other: str) -> None:
    text = FOLDER.joinpath("moves.txt").read_text("utf-8")
    assert reply in text
    changed = read("changed.txt", text.replace(reply, other, 1))
    with Simulator(changed.robot, dialects=["krc4"], clock="stepped") as simulator:
        (found,) = deviations(changed, simulator)
    assert found.startswith("changed.txt:")


def test_every_message_is_carried_out_in_one() -> None:
    expected = [
        replies(step.text.encode())[0].command
        for transcript in TRANSCRIPTS.values()
        for step in transcript.steps
        if isinstance(step, Answered) and step.compare is not Compare.ANY
    ]
    assert set(load_krc4_table().commands) <= set(expected)
    assert any(command < 0 for command in expected)


def deviations(transcript: Transcript, simulator: Simulator) -> list[str]:
    """What is answered otherwise, or without having been asked. Waits are in simulated time."""
    clients: dict[str, Krc4Client] = {}
    found: list[str] = []

    def leaves(name: str) -> None:
        with clients.pop(name) as client:
            client.sends_no_more()
            if rest := client.rest():
                found.append(f"{transcript.name}: {name} got more than was asked for: {rest!r}")

    for step in transcript.steps:
        name = step.step.client
        if name not in clients:
            clients[name] = Krc4Client(simulator.port)
        match step:
            case Connects():
                pass
            case Said():
                clients[name].send(wire_bytes(step.text))
            case Answered():
                if different := _difference(step, clients[name].reply_bytes().decode()):
                    found.append(f"{transcript.name}:{step.step.line}: {different}")
            case Wait(seconds=None):
                simulator.run_until_stopped()
            case Wait(seconds=float(seconds)):
                simulator.advance(seconds)
            case Leaves():
                leaves(name)
    for name in list(clients):
        leaves(name)
    return found


def _difference(expected: Answered, reply: str) -> str:
    if expected.compare is Compare.NUMBERS:
        return deviation(expected._replace(text=_numbers(expected.text)), _numbers(reply), {})
    return deviation(expected, reply, {})


def _numbers(reply: str) -> str:
    """The ten integers and ten reals, which is what the comparer knows as numbers."""
    (parsed,) = replies(reply.encode())
    return " ".join(map(repr, (*parsed.integers, *parsed.reals)))
