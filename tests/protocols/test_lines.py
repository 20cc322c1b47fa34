import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.protocols.lines import (
    MAX_LINE_BYTES,
    MAX_SUBNEGOTIATION,
    OVERLONG,
    TIMING_MARK,
    LineSplitter,
)
from tests.protocols.packets import cut

IAC, DONT, DO, WILL, SB, NOP, SE = b"\xff", b"\xfe", b"\xfd", b"\xfb", b"\xfa", b"\xf1", b"\xf0"

text = st.sampled_from([b"a", b"get status", b" ", b"\t", b"\0", b"\xe4", b":"])
ends = st.sampled_from([b"\r", b"\n", b"\r\n", b"\n\r"])
telnet = st.sampled_from(
    [IAC, DONT, DO, WILL, SB, NOP, SE, b"\x18", IAC + WILL + b"\x03", IAC + SB, IAC + SE, IAC + DO + b"\x06"]
)
long_text = st.integers(MAX_LINE_BYTES // 2 - 2, MAX_LINE_BYTES + 2).map(lambda length: b"x" * length)


def streams(*pieces: st.SearchStrategy[bytes]) -> st.SearchStrategy[bytes]:
    return st.lists(st.one_of(*pieces), max_size=25).map(b"".join)


def lines_of(packets: list[bytes]) -> list[bytes]:
    splitter = LineSplitter()
    lines = [line for packet in packets for line in splitter.feed(packet)]
    return lines + splitter.finish()


def without_telnet(stream: bytes) -> bytes:
    """The stream as RFC 854 reads it, one byte at a time, but for subnegotiations that are broken off.

    A timing mark leaves a byte of 1 in its place.
    """
    kept, state, subnegotiated, negotiation = bytearray(), "text", 0, 0
    for byte in stream:
        if state == "text":
            if byte == IAC[0]:
                state = "command"
            else:
                kept.append(byte)
        elif state == "command":
            if byte in b"\r\n":
                kept.append(byte)
            negotiation = byte
            state = "option" if WILL[0] <= byte <= DONT[0] else "within" if byte == SB[0] else "text"
        elif state == "option":
            if bytes([negotiation, byte]) == DO + b"\x06":
                kept.append(1)
            state = "text"
        else:
            if byte in b"\r\n":
                kept.append(byte)
                state = "text"
            elif state == "within" and byte == IAC[0]:
                state = "leaving"
            elif state == "leaving" and byte == SE[0]:
                state = "text"
            else:
                subnegotiated += 1
                state = "within" if subnegotiated < MAX_SUBNEGOTIATION else "text"
        if state not in ("within", "leaving"):
            subnegotiated = 0
    return bytes(kept)


def read_by_the_book(stream: bytes) -> list[bytes]:
    """What the module's docstring promises, in the plainest way."""
    lines, line, partner = [], b"", b""
    for byte in without_telnet(stream):
        this = bytes([byte])
        if this == b"\1":
            lines.append(TIMING_MARK)
        elif (this == b"\0" and not line) or this == partner:
            partner = b""
        elif this in (b"\r", b"\n"):
            if len(line) <= MAX_LINE_BYTES:
                lines.append(line)
            line, partner = b"", b"\r" if this == b"\n" else b"\n"
        else:
            line, partner = line + this, b""
            if len(line) == MAX_LINE_BYTES + 1:
                lines.append(OVERLONG)
    return [*lines, line] if 0 < len(line) <= MAX_LINE_BYTES else lines


@given(streams(text, ends, telnet).flatmap(lambda stream: st.tuples(st.just(stream), cut(stream))))
def test_lines_are_the_same_however_the_stream_is_cut(case):
    stream, packets = case
    assert lines_of(packets) == read_by_the_book(stream)


@given(streams(long_text, ends).flatmap(lambda stream: st.tuples(st.just(stream), cut(stream))))
def test_a_line_that_is_too_long_is_told_of_once(case):
    stream, packets = case
    assert lines_of(packets) == read_by_the_book(stream)


@pytest.mark.parametrize(
    ("alphabet", "longest"),
    [((b"a", b"\r", b"\n"), 5), ((b"a", b"\n", IAC, WILL, SB, SE), 3)],
    ids=["line ends", "telnet"],
)
def test_every_short_stream_in_every_two_packets(alphabet, longest):
    for pieces in itertools.product(alphabet, repeat=longest):
        stream = b"".join(pieces)
        for place in range(len(stream)):
            assert lines_of([stream[:place], stream[place:]]) == read_by_the_book(stream)


@pytest.mark.parametrize(
    "flood", [b"x" * 50_000, b"\xff\xfa" + b"x" * 50_000, b"\xff" * 49_999, b"\0" * 50_000]
)
def test_what_is_held_is_bounded(flood):
    splitter = LineSplitter()
    for _ in range(20):
        splitter.feed(flood)
        held = sum(len(value) for value in vars(splitter).values() if isinstance(value, bytes))
        assert held <= MAX_LINE_BYTES + len(IAC + SB) + 2 * MAX_SUBNEGOTIATION
