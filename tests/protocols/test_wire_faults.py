"""What faults on the wire make of replies, without a wire."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.protocols.faults import (
    Delay,
    Drop,
    Fault,
    Garble,
    Pass,
    Send,
    Split,
    Step,
    Wait,
    WireFaults,
)

REPLIES = st.lists(st.binary(max_size=12).map(lambda b: bytes(32 + x % 95 for x in b) + b"\r\n"), max_size=8)


class Somebody:
    """A connection that remembers."""

    def __init__(self) -> None:
        self.faulted = False
        self.taken: list[Step] = []
        self.went_on = 0

    def go_on(self) -> None:
        self.went_on += 1

    def take(self, steps: list[Step]) -> None:
        self.taken += steps


def connected(
    count: int = 1, tell: Callable[[str, str], None] = lambda _name, _what: None
) -> tuple[WireFaults, list[Somebody]]:
    faults, peers = WireFaults(tell), [Somebody() for _ in range(count)]
    for number, peer in enumerate(peers, 1):
        assert faults.arrives(peer, f"client {number}") == number
    return faults, peers


@pytest.mark.parametrize(
    ("fault", "steps"),
    [
        (Pass(), [Send(b"moving\r\n")]),
        (Delay(0.5), [Wait(0.5), Send(b"moving\r\n")]),
        (Split(3, 0.1), [Send(b"mov"), Wait(0.1), Send(b"ing\r\n")]),
        (Split(7, 0.1), [Send(b"moving\r"), Wait(0.1), Send(b"\n")]),
        (Split(8, 0.1), [Send(b"moving\r\n")]),
        (Drop(), []),
    ],
)
def test_what_a_fault_makes_of_a_reply(fault: Fault, steps: list[Step]) -> None:
    faults, peers = connected()
    faults.set(fault, 1, 1)
    assert list(faults.steps(1, b"moving\r\n")) == steps
    assert not peers[0].faulted
    assert list(faults.steps(1, b"moving\r\n")) == [Send(b"moving\r\n")]


@given(replies=REPLIES, seed=st.integers(0, 2**32 - 1))
def test_garbled_is_all_but_the_line_end_and_the_same_for_a_seed(replies: list[bytes], seed: int) -> None:
    garbled = []
    for _ in range(2):
        faults, _ = connected()
        faults.seed(seed)
        faults.set(Garble())
        garbled.append([step.data for step in faults.steps(1, b"".join(replies)) if isinstance(step, Send)])
    assert garbled[0] == garbled[1]
    assert [len(each) for each in garbled[0]] == [len(each) for each in replies]
    for was, now in zip(replies, garbled[0], strict=True):
        assert now.endswith(b"\r\n")
        assert all(a != b and 33 <= b <= 126 for a, b in zip(was[:-2], now[:-2], strict=True))
