"""KRC4 messages in transcripts: read, filled in, compared."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.protocols.krc4_xml import (
    Broken,
    Element,
    XmlStream,
    from_short,
    reply,
    short_reply,
    to_xml,
    understand,
    word_for_word,
    written,
)
from iiwa_sim.transcript.fault import TranscriptFault
from iiwa_sim.transcript.krc4 import ask_idle, filled, is_moving, sent
from iiwa_sim.transcript.krc4_compare import deviation
from iiwa_sim.transcript.lines import Answered, Compare, Connects, Step, Transcript, read

INTEGERS = st.lists(st.integers(-(2**31), 2**31 - 1), min_size=2, max_size=10)
REALS = st.lists(st.floats(-1e6, 1e6).map(lambda value: round(value, 9) + 0.0), max_size=10)
HEARD = {"GOP": "Res I0=1 I1=310 R0=445 R2=810.5", "FIN": "Res I0=2 I1=100 I2=1", "DIS": "Res I0=3 I1=-300"}


def krc4(text: str) -> Transcript:
    return read("one.txt", f"protocol krc4\n{text}")


def expected(text: str, compare: Compare = Compare.EXACT, within: float = 0.0) -> Answered:
    return Answered(Step(1, "", None, "krc4"), text, compare, within)


@given(INTEGERS, REALS)
def test_a_reply_in_short_form_is_the_one_on_the_wire(integers: list[int], reals: list[float]) -> None:
    wire = reply(integers, reals).decode()
    short = short_reply(integers, reals)
    assert deviation(expected(short), wire, {}) == ""
    assert deviation(expected(wire), wire, {}) == ""
    assert deviation(expected(wire, Compare.NUMBERS, 1e-9), wire, {}) == ""
    other = [integers[0], integers[1] - 1 if integers[1] > 0 else integers[1] + 1, *integers[2:]]
    assert deviation(expected(short), reply(other, reals).decode(), {})


@given(st.binary(max_size=60) | st.text("<>/CmdRes I0R1=\"'&;! {}\\\n-7.", max_size=60).map(str.encode))
def test_what_a_session_writes_down_is_said_again_with_the_same_meaning(data: bytes) -> None:
    def first(wire: bytes) -> tuple[Element | Broken | None, bytes]:
        stream = XmlStream()
        stream.receive(wire)
        return stream.next(), stream.wire

    found, wire = first(data)
    if found is None:
        return
    text = word_for_word(wire) if isinstance(found, Broken) else written(found, wire)
    transcript = krc4(f"> {text.replace('{', chr(92) + 'x7b')}\n<?\n")
    again, _ = first(sent(transcript.steps[0].text))
    if isinstance(found, Broken):
        assert again == found
    else:
        assert isinstance(again, Element)
        assert understand(again) == understand(found)


def test_the_short_form_goes_out_as_elements() -> None:
    assert sent("Cmd I0=7 I1=20 R0=1,5 X=a&b") == (
        b"<Cmd><I0>7</I0><I1>20</I1><R0>1,5</R0><X>a&amp;b</X></Cmd>"
    )
    assert sent("Cmd") == b"<Cmd></Cmd>"
    assert sent(r"\x43md I0=1") == b"Cmd I0=1"
    assert sent(r"<Cmd>\n</Cmd>") == b"<Cmd>\n</Cmd>"
    assert to_xml(from_short("Res  I0=")) == b"<Res><I0></I0></Res>"


@pytest.mark.parametrize(
    ("text", "given"),
    [
        ("Cmd I0=2 I1=10 {GOP}", "Cmd I0=2 I1=10 R0=445.0 R2=810.5"),
        ("Cmd {GOP + 0 1 -810.5 0 0 2}", "Cmd R0=445.0 R1=1.0 R5=2.0"),
        ("Cmd R0={GOP R2} R1={GOP R2 + 1} R2={GOP R9} I3={FIN I2}", "Cmd R0=810.5 R1=811.5 R2=0.0 I3=1"),
        ("<Cmd><R0>{GOP R0}</R0></Cmd>", "<Cmd><R0>445.0</R0></Cmd>"),
        (r"\x7bGOP} {gop}", r"\x7bGOP} {gop}"),
    ],
)
def test_what_was_heard_is_put_in(text: str, given: str) -> None:
    assert filled(text, HEARD) == given


@pytest.mark.parametrize("text", ["{GOA}", "{GOA R1}", "{DIS R0}"])
def test_what_was_never_heard_or_refused_is_not(text: str) -> None:
    with pytest.raises(ValueError, match=r"asked yet|expected 'DIS' to have been answered"):
        filled(text, HEARD)


@pytest.mark.parametrize(
    ("wanted", "compare", "got", "told"),
    [
        ("Res I0=1 I1=310 R0=445", Compare.EXACT, "Res I0=1 I1=310 R0=445.000", ""),
        ("Res I0=1 I1=310 {GOP}", Compare.EXACT, "<Res I0='1' I1='310' R0='445' R2='810.5'/>", ""),
        ("Res I0=1 I1=100", Compare.EXACT, "Res I0=1 I1=100 I2=1", "got 'Res I0=1 I1=100 I2=1'"),
        (
            "Res I0=1 I1=310 R0=1",
            Compare.EXACT,
            "Res I0=1 I1=310 R0=2",
            "expected 'Res I0=1 I1=310 R0=1.0', got",
        ),
        ("Res I0=1 I1=310 R0=1", Compare.NUMBERS, "Res I0=1 I1=310 R0=1.4", ""),
        (
            "Res I0=1 I1=310 R0=1",
            Compare.NUMBERS,
            "Res I0=1 I1=310 R0=1.6",
            "R0 is 1.6, expected 1.0 within 0.5",
        ),
        ("Res I0=1 I1=310", Compare.NUMBERS, "<Res><I0>x</I0></Res>", "I0 = x: expected an integer"),
        ("Res I0=1 I1=320 {GOA}", Compare.NUMBERS, "Res", "'GOA' has not been asked yet"),
        ("<Res><I0>1</I0></Res>", Compare.EXACT, "<Res I0='1'/>", "expected '<Res><I0>1</I0></Res>', got"),
        (r"<Res a='\x7b'/>", Compare.EXACT, "<Res a='{'/>", ""),
        ("Res I0=1", Compare.ANY, "anything", ""),
    ],
)
def test_replies_are_compared(wanted: str, compare: Compare, got: str, told: str) -> None:
    found = deviation(expected(wanted, compare, 0.5), got, HEARD)
    assert told in found if told else found == ""


def test_any_reals_will_do_but_not_any_ids() -> None:
    any_reals = expected("Res I0=1 I1=300 R0=5", Compare.NUMBERS, float("inf"))
    assert deviation(any_reals, "Res I0=1 I1=300 R0=-1e9", {}) == ""
    assert deviation(any_reals, "Res I0=2 I1=300", {})


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("> Cmd I0\n<?", "one.txt:2: '> Cmd I0': 'I0': expected NAME=VALUE"),
        ("> <Cmd>\\q\n<?", "no escape"),
        ("> Cmd {GOX}\n<?", "{GOX}: expected one of STO, LIN"),
        ("> Cmd {GOP + x}\n<?", "{GOP + x}: expected finite numbers behind the +, got 'x'"),
        ("> Cmd\n< Res X=1", "one.txt:3: '< Res X=1': X: expected I0 to I9"),
        ("> Cmd\n< Cmd I0=1", "Cmd: expected Res"),
        ("> Cmd\nwait stopped\n<?", "one.txt:3: 'wait stopped': expected the replies to the lines above"),
        ("a connects in iiwa", "expected one of the protocols of this transcript, krc4"),
        ("protocol iiwa,klingon", "expected iiwa or krc4, each at most once"),
        ("> Cmd\n<?\nprotocol iiwa", "one.txt:4: 'protocol iiwa': expected above all that is said"),
    ],
)
def test_what_is_no_transcript_is_told_with_its_line(text: str, told: str) -> None:
    with pytest.raises(TranscriptFault) as caught:
        krc4(text)
    assert told in str(caught.value)
    assert str(caught.value).isprintable()


def test_each_client_speaks_its_own() -> None:
    transcript = read(
        "one.txt", "protocol krc4,iiwa\na connects in iiwa\na> hello\na< hello\n> Cmd I1=310\n<?\n"
    )
    assert transcript.protocols == ("krc4", "iiwa")
    assert [step.step.protocol for step in transcript.steps] == ["iiwa"] * 3 + ["krc4"] * 2
    assert isinstance(transcript.steps[0], Connects)
    assert transcript.commands == {"hello", "GOP"}


def test_the_question_whether_it_moves_has_an_id_of_its_own() -> None:
    question = ask_idle(
        ["Cmd I0=2147483647 I1=100", '<Cmd I0="2147483646"/>', "<Cmd><I0>2147483645</I0></Cmd>"]
    )
    assert question == "Cmd I0=2147483644 I1=100"
    assert is_moving(question, "Res I0=2147483644 I1=100")
    assert not is_moving(question, "<Res I0='2147483644' I1='100' I2='1'/>")
    for nonsense in ("Res I0=7 I1=100", "Res I0=2147483644 I1=-100 I2=3040", "Res I0=2147483644 I1=100 I2=2"):
        with pytest.raises(ValueError, match="expected I2 to be 0 or 1"):
            is_moving(question, nonsense)
