"""The dialogues of protocol/transcripts, replayed over a real socket."""

from __future__ import annotations

from importlib.resources import files

import pytest

from iiwa_sim.dialect.table import load_table
from tests.talking import Client

TRANSCRIPTS = {
    each.name: each.read_text()
    for each in files("iiwa_sim.protocol").joinpath("transcripts").iterdir()
    if each.name.endswith(".txt")
}
WITH_MOTION = {"cancel move", "clear queue", "get queue"}  # what they answer depends on when they come


def exchanges(text: str) -> list[tuple[str, str]]:
    """What is said and what is answered, line by line."""
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    said, answered = lines[::2], lines[1::2]
    assert all(line.startswith("> ") for line in said)
    assert all(line.startswith("< ") for line in answered)
    return [(one[2:], other[2:]) for one, other in zip(said, answered, strict=True)]


@pytest.mark.requirement(
    "FRC005", "FRC007", "FRC019", "FRC020", "FRC021", "FRC022", "FRC023", "FRC024", "FRC025", "FRC026"
)
@pytest.mark.parametrize("name", TRANSCRIPTS)
async def test_a_transcript_is_answered_word_for_word(client: Client, name: str) -> None:
    for said, answered in exchanges(TRANSCRIPTS[name]):
        assert await client.ask(said) == answered, said


def test_every_command_that_is_an_extension_is_in_one() -> None:
    said = {line.partition(" :")[0] for text in TRANSCRIPTS.values() for line, _ in exchanges(text)}
    ours = {name for name, command in load_table("iiwa").commands.items() if command.extension}
    assert ours - said <= WITH_MOTION
