"""Bytes to messages: cut anywhere, and whatever is no message."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from iiwa_sim.protocols.krc4_xml import MAX_MESSAGE_BYTES, Element, XmlStream

NAMES = st.sampled_from(["I0", "I1", "I2", "I9", "R0", "R5", "R9", "X"])
TEXTS = st.text("019.eE+-  <>&;'\"]aZ\u00e9\u20ac\U0001f916", max_size=12)
VALUES = st.dictionaries(NAMES, TEXTS, max_size=6)


def read(*packets: bytes, ends: bool = False) -> list[Element | str]:
    """Return all messages of packets, and the reason of a broken stream."""
    stream = XmlStream()
    found: list[Element | str] = []

    def take() -> None:
        while not (found and isinstance(found[-1], str)) and (one := stream.next()) is not None:
            found.append(one.fault if one.breaks else one)

    for packet in packets:
        stream.receive(packet)
        take()
    if ends:
        stream.end()
        take()
    return found


@st.composite
def messages(draw: st.DrawFn) -> tuple[bytes, dict[str, str]]:
    """Return a message as a driver's XML library writes it, and its values."""
    attributes, children = draw(VALUES), draw(VALUES)
    children = {name: text for name, text in children.items() if name not in attributes}
    root = ET.Element("Cmd", attributes)
    for name, text in children.items():
        ET.SubElement(root, name).text = text
    wire = ET.tostring(root, encoding="utf-8", xml_declaration=draw(st.booleans()))
    return wire + draw(st.sampled_from([b"", b" ", b"\r\n", b"\n\t", b"\0"])), {**attributes, **children}


@example([(b"<Cmd/>\0\xef\xbb\xbf", {}), (b"\xef\xbb\xbf<Cmd I0='1'/>", {"I0": "1"})], [])
@given(st.lists(messages(), max_size=4), st.lists(st.integers(1, 40), max_size=20))
def test_messages_are_the_same_from_any_packets(
    sent: list[tuple[bytes, dict[str, str]]], lengths: list[int]
) -> None:
    wire = b"".join(one for one, _ in sent)
    packets, place = [], 0
    for length in lengths:
        packets.append(wire[place : place + length])
        place += length
    found = read(*packets, wire[place:])
    assert found == [Element("Cmd", values, "") for _, values in sent]
    assert read(*[bytes([byte]) for byte in wire]) == found


@given(st.binary(max_size=200), st.lists(st.integers(1, 20), max_size=10))
def test_any_bytes_are_messages_or_break_the_stream_and_are_the_same_in_parts(
    wire: bytes, lengths: list[int]
) -> None:
    packets, place = [], 0
    for length in lengths:
        packets.append(wire[place : place + length])
        place += length
    found = read(wire, ends=True)
    assert read(*packets, wire[place:], ends=True) == found
    assert not any(isinstance(one, str) for one in found[:-1])


NO_DTD = "expected no DTD"
TOO_LONG = f"a message of more than {MAX_MESSAGE_BYTES} bytes"
BROKEN = {
    b"hello": "a message begins with <",
    b"<Cmd><I0>1</I1></Cmd>": "no XML: mismatched tag",
    b"<Cmd>\x00</Cmd>": "no XML: not well-formed (invalid token)",
    "<Cmd><I0>1</I0></Cmd>".encode("utf-16-le"): "expected UTF-8",
    b"<!DOCTYPE a [<!ENTITY b 'c'><!ENTITY d '&b;&b;'>]><Cmd><I0>&d;</I0></Cmd>": NO_DTD,
    b"<!---->" * 2000 + b"<!DOCTYPE a>": NO_DTD,
    b"<Cmd><I0>1</I0>": "the stream ends within a message",
    b"<" + b"a" * MAX_MESSAGE_BYTES: TOO_LONG,
    b"<Cmd>" + b"<I0>1</I0>" * MAX_MESSAGE_BYTES: TOO_LONG,
    b"\xef\xbb": "a message begins with <",
    b"<Cmd/\xef\xbb\xbf>": "no XML: not well-formed (invalid token)",
}


@pytest.mark.parametrize("wire", BROKEN, ids=lambda wire: repr(wire[:30]))
def test_a_malformed_message_breaks_the_stream_for_good(wire: bytes) -> None:
    assert read(b"<Cmd I0='1'/>" + wire, b"", ends=True) == [
        Element("Cmd", {"I0": "1"}, ""),
        BROKEN[wire],
    ]
    in_parts = read(*[wire[place : place + 50] for place in range(0, len(wire), 50)], b"<Cmd/>", ends=True)
    if "ends within" not in BROKEN[wire]:
        assert in_parts == [BROKEN[wire]]


def test_the_longest_message_is_accepted_and_one_byte_more_is_not() -> None:
    start, end = b"<Cmd><I0>", b"</I0></Cmd>"
    digits = MAX_MESSAGE_BYTES - len(start) - len(end)
    assert read(start + b"1" * digits + end) == [Element("Cmd", {"I0": "1" * digits}, "")]
    (broken,) = read(start + b"1" * (digits + 1) + end)
    assert isinstance(broken, str)
