"""Transcripts and malformed transcripts."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.transcript.lines import Kind, read, read_file
from iiwa_sim.transcript.texts import TranscriptFault, wire_bytes


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("hello", "one.txt:1: 'hello': expected `> words`"),
        ("> hello\n< hello\n< hello\n", "one.txt:3: '< hello': a reply to nothing"),
        ("> hello\n< hello\n> stop\n", "one.txt:3: expected a reply to each line"),
        ("> hello\nwait stopped\n< hello\n", "one.txt:2: 'wait stopped': expected the replies"),
        ("> hello\n<~x 1\n", "one.txt:2: '<~x 1': expected `> words`"),
        ("> hello\n<~1.2.3 1\n", "one.txt:2: '<~1.2.3 1': could not convert string to float: '1.2.3'"),
        ("[1] > hello\n", "expected `> words`"),
        ("\ud800\x1b[2J\n", r"\x1b"),
    ],
)
def test_a_malformed_transcript_is_reported_with_its_line(text: str, reason: str) -> None:
    with pytest.raises(TranscriptFault) as caught:
        read("one.txt", text)
    assert reason in str(caught.value)
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) <= 400


@given(st.binary())
def test_any_line_is_recorded_and_sent_unchanged(line: bytes) -> None:
    written = repr(line)[2:-1]
    transcript = read("one", f"> {written}\n<? \n")
    (said, _) = transcript.steps
    assert said.kind is Kind.COMMAND
    assert wire_bytes(said.text) == line


@given(st.text('<>?#[]{} .:09ac\\"\n\r\t\x00\x1b\u00e9\u2028\ufeff'))
def test_any_text_is_read_or_rejected(text: str) -> None:
    try:
        transcript = read("one", text)
    except TranscriptFault:
        return
    said = sum(step.kind is Kind.COMMAND for step in transcript.steps)
    assert said == sum(step.kind.is_reply for step in transcript.steps)


def test_a_file_may_begin_with_a_byte_order_mark(tmp_path: Path) -> None:
    file = tmp_path / "marked.txt"
    file.write_text("\ufeff> hello\n< hello\n", encoding="utf-8")
    assert read_file(file).commands == {"hello"}
