"""The guard: without leave to move the robot, nothing passes that could."""

from __future__ import annotations

import contextlib
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.check.link import COMMANDS, HARMLESS, Link, NotAllowed, Talk

CHANGING = sorted(name for name in COMMANDS if name not in HARMLESS)


class Deaf:
    """Remembers what it is sent."""

    def __init__(self) -> None:
        self.sent = b""

    def send(self, data: bytes) -> None:
        self.sent += data


def talk(allow_motion: bool) -> tuple[Talk, Deaf]:
    wire = Deaf()
    return Talk(Link("", 0, allow_motion), wire), wire


@given(
    before=st.sampled_from([b"", b"hello\r\n", b"get status\n", b"\r", b"hello : "]),
    name=st.sampled_from(CHANGING),
    blanks=st.sampled_from([b" ", b"  ", b"\t"]),
    upper=st.booleans(),
    rest=st.sampled_from([b"", b" : 1 2 3", b":", b" : {get joint position}"]),
    end=st.sampled_from([b"\r\n", b"\n", b"\r", b"", b"\rhello\r\n"]),
    cuts=st.lists(st.integers(0, 60), max_size=4),
)
def test_no_command_that_moves_gets_through(
    before: bytes, name: str, blanks: bytes, upper: bool, rest: bytes, end: bytes, cuts: list[int]
) -> None:
    line = blanks.join((name.upper() if upper else name).encode().split())
    data = before + line + rest + end
    guarded, wire = talk(allow_motion=False)
    places = sorted({0, *(cut for cut in cuts if cut < len(data)), len(data)})
    with contextlib.suppress(NotAllowed):
        for start, stop in pairwise(places):
            guarded.send(data[start:stop])
    whole = before.endswith(b": ")  # then it is only a parameter of hello
    assert whole or len(wire.sent) < len(before) + len(line)
