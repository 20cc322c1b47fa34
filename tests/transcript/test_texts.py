"""Texts of transcripts: sent, filled in, and compared with replies."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.protocols.krc4_xml import (
    Element,
    XmlStream,
    understand,
    written,
)
from iiwa_sim.transcript.lines import Transcript, read
from iiwa_sim.transcript.texts import TranscriptFault, deviation, filled, sent

REPLIES = {"get tool frame": "450.0 0.0 520.5", "get status": "stopped"}


def krc4(text: str) -> Transcript:
    return read("one.txt", f"protocol krc4\n{text}")


@pytest.mark.parametrize(
    ("wanted", "within", "got", "reason"),
    [
        ("done", None, "done", ""),
        ("done", None, "error", "expected 'done', got 'error'"),
        (r"\x7bget status}", None, "{get status}", ""),
        ("1 2", 0.5, "1.0 2.6", "value 2 is 2.6, expected 2 within 0.5: '1.0 2.6'"),
        ("1 2", 0.5, "error", "expected 2 values, got 1: 'error'"),
        ("the force is 80.5 N", 0.5, "the force is 81.0 N", ""),
    ],
)
def test_a_line_is_compared(wanted: str, within: float | None, got: str, reason: str) -> None:
    found = deviation("iiwa", wanted, within, got)
    assert reason in found if reason else found == ""


@pytest.mark.parametrize(
    ("wanted", "within", "got", "reason"),
    [
        ("Res I0=1 I1=310 R0=445", None, "Res I0=1 I1=310 R0=445.000", ""),
        ("Res I0=1 I1=100", None, "Res I0=1 I1=100 I2=1", "I2 is 1, expected 0"),
        ("Res I0=1 I1=310 R0=1", 0.5, "Res I0=1 I1=310 R0=1.6", "R0 is 1.6, expected 1.0 within 0.5"),
        ("<Res><I0>1</I0></Res>", None, "<Res I0='1'/>", "expected '<Res><I0>1</I0></Res>', got"),
    ],
)
def test_a_message_is_compared(wanted: str, within: float | None, got: str, reason: str) -> None:
    found = deviation("krc4", wanted, within, got)
    assert reason in found if reason else found == ""


@pytest.mark.parametrize(
    ("text", "given"),
    [
        ("{get status}", "stopped"),
        ("lin move : {get tool frame + 0 0 10}", "lin move : 450.000000000 0.000000000 530.500000000"),
        ("{get tool frame 3}", "520.5"),
    ],
)
def test_replies_are_filled_in(text: str, given: str) -> None:
    assert filled("iiwa", text, REPLIES) == given


@given(st.binary(max_size=60) | st.text("<>/CmdRes I0R1=\"'&;! {}\\\n-7.", max_size=60).map(str.encode))
def test_a_recorded_message_is_sent_again_with_the_same_meaning(data: bytes) -> None:
    def first(wire: bytes) -> tuple[Element | None, bytes]:
        stream = XmlStream()
        stream.receive(wire)
        return stream.next(), stream.wire

    found, wire = first(data)
    if found is None:
        return
    text = written(found, wire)
    transcript = krc4(f"> {text.replace('{', chr(92) + 'x7b')}\n<?\n")
    again, _ = first(sent("krc4", transcript.steps[0].text))
    assert again is not None
    assert (again.breaks, understand(again)) == (found.breaks, understand(found))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("protocol iiwa,klingon", "expected iiwa or krc4, each at most once"),
        ("> Cmd\n<?\nprotocol iiwa", "one.txt:4: 'protocol iiwa': expected iiwa or krc4"),
    ],
)
def test_a_malformed_transcript_names_its_line(text: str, reason: str) -> None:
    with pytest.raises(TranscriptFault) as caught:
        krc4(text)
    assert reason in str(caught.value)
