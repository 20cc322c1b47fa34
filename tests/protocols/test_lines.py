import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.protocols.lines import MAX_LINE_BYTES, OVERLONG, LineSplitter
from tests.protocols.packets import cut

text = st.sampled_from([b"a", b"get status", b" ", b"\t", b"\0", b"\xe4", b":"])
ends = st.sampled_from([b"\r", b"\n", b"\r\n", b"\n\r"])
long_text = st.integers(MAX_LINE_BYTES // 2 - 2, MAX_LINE_BYTES + 2).map(lambda length: b"x" * length)


def streams(*pieces: st.SearchStrategy[bytes]) -> st.SearchStrategy[bytes]:
    return st.lists(st.one_of(*pieces), max_size=25).map(b"".join)


def lines_of(packets: list[bytes]) -> list[bytes]:
    splitter = LineSplitter()
    lines = [line for packet in packets for line in splitter.feed(packet)]
    return lines + splitter.finish()


def read_by_the_book(stream: bytes) -> list[bytes]:
    """Split lines in the plainest form."""
    lines, line, partner = [], b"", b""
    for byte in stream:
        this = bytes([byte])
        if this == partner:
            partner = b""
        elif this in (b"\r", b"\n"):
            if len(line) <= MAX_LINE_BYTES:
                lines.append(line)
            line, partner = b"", b"\r" if this == b"\n" else b"\n"
        else:
            line, partner = line + this, b""
            if len(line) == MAX_LINE_BYTES + 1:
                lines.append(OVERLONG)
    if line.strip(b"\0") and len(line) <= MAX_LINE_BYTES:
        lines.append(line)
    return [line.lstrip(b"\0") for line in lines]


@given((streams(text, ends) | streams(long_text, ends)).flatmap(lambda s: st.tuples(st.just(s), cut(s))))
def test_lines_are_the_same_from_any_packets_and_long_ones_are_reported_once(case):
    stream, packets = case
    assert lines_of(packets) == read_by_the_book(stream)


@given(cut(b"\xff\xfb\x18get \xff\xffsta\xff\xfa\x18tus\xff\xfe\nhello\xff\r\n\xff\xf4"))
def test_telnets_commands_are_no_part_of_a_line(packets):
    assert lines_of(packets) == [b"get sta\x18tus", b"hello"]


@pytest.mark.parametrize("flood", [b"x" * 50_000, b"\xff" * 49_999, b"\0" * 50_000])
def test_buffered_bytes_are_bounded(flood):
    splitter = LineSplitter()
    for _ in range(20):
        splitter.feed(flood)
        held = sum(len(value) for value in vars(splitter).values() if isinstance(value, bytes))
        assert held <= MAX_LINE_BYTES
