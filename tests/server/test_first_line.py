"""What a web browser sends to a port of lines, whichever way it is cut; and what only looks like it."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.server.first_line import LONGEST, FirstLine, FromBrowserFault

POST = b"POST /x?lin+move HTTP/1.1\r\nHost: a\r\n\r\nstop\r\n"
FROM_BROWSERS = [
    POST,
    b"GET / HTTP/1.1\r\n\r\n",
    b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    b"GET /" + b"x" * 100_000 + b" HTTP/1.1\r\n",
    b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\nstop\n",
]
LINES = [
    b"get status\r\n",
    b"GET STATUS :\r\nGET / HTTP/1.1\r\n",
    b'<Cmd I0="1" I1="310"/>',
    b"\xff\xfd\x06",
    b"x" * 5000,
    b"\xfe\x16\x03\n",
]


def taken(chunks: list[bytes]) -> bytes:
    first = FirstLine()
    handed_on = b""
    for chunk in chunks:
        handed_on += chunk if first.passed else first.take(chunk)
    return handed_on


def cut(data: bytes, places: list[int]) -> list[bytes]:
    edges = sorted({0, len(data), *(place % len(data) for place in places)})
    return [data[begin:end] for begin, end in pairwise(edges)]


@pytest.mark.parametrize("data", FROM_BROWSERS)
@given(places=st.lists(st.integers(0, 10_000), max_size=5))
def test_of_what_browsers_send_nothing_is_handed_on(data: bytes, places: list[int]) -> None:
    first = FirstLine()
    try:
        for chunk in cut(data, places):
            assert first.take(chunk) == b""
    except FromBrowserFault:
        return
    pytest.fail("it was not recognised")


@pytest.mark.parametrize("data", LINES)
@given(places=st.lists(st.integers(0, 10_000), max_size=5))
def test_lines_are_handed_on_whole(data: bytes, places: list[int]) -> None:
    assert taken(cut(data, places)) == data


def test_a_message_without_a_line_end_does_not_wait_for_one() -> None:
    assert FirstLine().take(b'<Cmd I0="1" I1="310"/>')
    assert FirstLine().take(b"x" * (LONGEST + 1))


def test_what_is_kept_back_is_handed_on_in_the_end() -> None:
    first = FirstLine()
    assert first.take(b"hel") == first.take(b"lo") == b""
    assert first.rest() == b"hello"
    assert first.passed
