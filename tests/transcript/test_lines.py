"""What a transcript says, and what is none."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.transcript.lines import (
    Answered,
    Compare,
    Connects,
    Leaves,
    Said,
    Step,
    Wait,
    read,
    read_file,
)
from iiwa_sim.transcript.texts import TranscriptFault, wire_bytes

TEXT = """# a comment

only lbr_iiwa_7_r800 at home
> get status
< stopped
> get tool frame
<~0.5 450 0 520 0 -1.57 0
> get tool frame
<~ 1 2
> get error
<? 3021 out of reach
wait stopped
wait 0.5
driver connects
driver> hello
driver< hello
driver leaves
[12.5 0.514] other> hello
[   12.502     0.515]   other <~inf 1
[13 14] other wait stopped
>
<
"""


def test_every_kind_of_line() -> None:
    transcript = read("one.txt", TEXT)
    assert transcript.robot == "lbr_iiwa_7_r800"
    assert transcript.commands == {"get status", "get tool frame", "get error", "hello", ""}
    assert transcript.steps == (
        Said(Step(4, "", None), "get status"),
        Answered(Step(5, "", None), "stopped", Compare.EXACT, None),
        Said(Step(6, "", None), "get tool frame"),
        Answered(Step(7, "", None), "450 0 520 0 -1.57 0", Compare.NUMBERS, 0.5),
        Said(Step(8, "", None), "get tool frame"),
        Answered(Step(9, "", None), "1 2", Compare.NUMBERS, 1e-6),
        Said(Step(10, "", None), "get error"),
        Answered(Step(11, "", None), "3021 out of reach", Compare.ANY, None),
        Wait(Step(12, "", None), None),
        Wait(Step(13, "", None), 0.5),
        Connects(Step(14, "driver", None)),
        Said(Step(15, "driver", None), "hello"),
        Answered(Step(16, "driver", None), "hello", Compare.EXACT, None),
        Leaves(Step(17, "driver", None)),
        Said(Step(18, "other", 12.5), "hello"),
        Answered(Step(19, "other", 12.502), "1", Compare.NUMBERS, float("inf")),
        Wait(Step(20, "other", 13.0), None),
        Said(Step(21, "", None), ""),
        Answered(Step(22, "", None), "", Compare.EXACT, None),
    )


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("hello", "one.txt:1: 'hello': expected `> words`"),
        ("> hello\n< hello\n< hello\n", "one.txt:3: '< hello': a reply to nothing"),
        ("> hello\n< hello\n> stop\n", "one.txt:3: expected a reply to each line"),
        ("> hello\nwait stopped\n< hello\n", "one.txt:2: 'wait stopped': expected the replies"),
        ("a> hello\na leaves\na< hello\n", "one.txt:2: 'a leaves': expected the replies"),
        ("> hello\n<~x 1\n", "one.txt:2: '<~x 1': expected a number, at least 0, got 'x'"),
        ("wait a while\n", "expected `> words`"),
        ("[1] > hello\n", "expected `> words`"),
        ("> a\\q\n< ?\n", "no escape"),
        ("\ud800\x1b[2J\n", r"\x1b"),
    ],
)
def test_what_is_no_transcript_is_told_with_its_line(text: str, told: str) -> None:
    with pytest.raises(TranscriptFault) as caught:
        read("one.txt", text)
    assert told in str(caught.value)
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) <= 400


@given(st.binary())
def test_any_line_can_be_written_and_is_sent_as_it_was(line: bytes) -> None:
    written = repr(line)[2:-1]
    transcript = read("one", f"> {written}\n<? \n")
    (said, _) = transcript.steps
    assert isinstance(said, Said)
    assert wire_bytes(said.text) == line


@given(st.text())
def test_any_text_is_read_or_told_of(text: str) -> None:
    try:
        transcript = read("one", text)
    except TranscriptFault:
        return
    said = sum(isinstance(step, Said) for step in transcript.steps)
    assert said == sum(isinstance(step, Answered) for step in transcript.steps)


def test_a_file_may_begin_with_a_byte_order_mark(tmp_path: Path) -> None:
    file = tmp_path / "marked.txt"
    file.write_text("\ufeff> hello\n< hello\n", encoding="utf-8")
    assert read_file(file).commands == {"hello"}


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(TranscriptFault, match="cannot be read: No such file"):
        read_file(tmp_path / "none.txt")
