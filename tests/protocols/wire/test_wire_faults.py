"""What faults on the wire make of replies, without a wire."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.controller.errors import Refused
from iiwa_sim.protocols.faults import (
    EVERY,
    NEXT,
    Close,
    CloseAfter,
    CloseBefore,
    Delay,
    Drop,
    Fault,
    Garble,
    Pass,
    Reset,
    ResetBefore,
    Send,
    Silence,
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


def kinds(steps: list[Step]) -> list[type]:
    return [type(step) for step in steps]


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


@pytest.mark.parametrize(
    ("fault", "steps"), [(CloseBefore(), [Close]), (CloseAfter(), [Send, Close]), (ResetBefore(), [Reset])]
)
def test_nothing_comes_behind_an_end(fault: Fault, steps: list[type]) -> None:
    faults, _ = connected()
    faults.set(fault)
    assert kinds(list(faults.steps(1, b"done\r\nmoving\r\n"))) == steps


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


@given(
    replies=REPLIES,
    asked=st.lists(
        st.tuples(st.sampled_from([Pass(), Delay(0.1), Split(2, 0.0), Drop()]), st.integers(0, 3)), max_size=5
    ),
)
def test_faults_take_their_replies_one_fault_after_the_other_and_keep_their_order(
    replies: list[bytes], asked: list[tuple[Fault, int]]
) -> None:
    faults, _ = connected()
    for fault, count in asked:
        faults.set(fault, 1, count)
    expected: list[Fault] = []
    for fault, count in asked:
        expected += [fault] * (count or len(replies))
    expected += [Pass()] * len(replies)
    kept = [reply for reply, fault in zip(replies, expected, strict=False) if not isinstance(fault, Drop)]
    steps = list(faults.steps(1, b"".join(replies)))
    assert b"".join(step.data for step in steps if isinstance(step, Send)) == b"".join(kept)
    late = sum(isinstance(fault, Delay) for fault in expected[: len(replies)])
    assert steps.count(Wait(0.1)) == late


KRC4 = b"<Res><I0>7</I0><I1>100</I1></Res>"


@pytest.mark.parametrize(
    ("fault", "steps", "told"),
    [
        (Pass(), [Send(KRC4)], []),
        (Delay(0.5), [Wait(0.5), Send(KRC4)], ["0.5 s of silence, the reply"]),
        (
            Split(4, 0.1),
            [Send(KRC4[:4]), Wait(0.1), Send(KRC4[4:])],
            ["'<Res', 0.1 s of silence, '><I0>7</I0><I1>100</I1></Res>'"],
        ),
        (Split(len(KRC4), 0.1), [Send(KRC4)], []),
        (Drop(), [], ["nothing"]),
    ],
)
def test_a_message_of_the_krc4_is_one_reply(fault: Fault, steps: list[Step], told: list[str]) -> None:
    heard: list[tuple[str, str]] = []
    faults = WireFaults(lambda name, text: heard.append((name, text)))
    faults.arrives(Somebody(), "somebody", "krc4")
    assert faults.connections() == {1: "somebody (krc4)"}
    faults.set(fault, replies=1)
    assert list(faults.steps(1, KRC4 + KRC4)) == [*steps, Send(KRC4)]
    assert heard == [("somebody", text) for text in told]


def test_a_fault_of_one_connection_is_not_that_of_another() -> None:
    faults, peers = connected(2)
    faults.set(Drop(), 2)
    assert not peers[0].faulted
    assert peers[1].faulted
    assert list(faults.steps(1, b"done\r\n")) == [Send(b"done\r\n")]
    faults.leaves(2)
    assert faults.connections() == {1: "client 1"}
    with pytest.raises(Refused, match="no connection 2: there are 1"):
        faults.set(Drop(), 2)


def test_one_number_for_all_connections() -> None:
    faults, peers = connected(1)
    faults.set(Drop(), EVERY, 3)
    peers.append(Somebody())
    faults.arrives(peers[1], "client 2")
    assert [peer.faulted for peer in peers] == [True, True]
    taken = [len(list(faults.steps(number, b"done\r\n"))) for number in (1, 2, 1, 2, 1)]
    assert taken == [0, 0, 0, 1, 1]
    assert [peer.faulted for peer in peers] == [False, False]


def test_the_next_connection_is_the_one_that_comes() -> None:
    faults, peers = connected()
    faults.set(Drop(), NEXT)
    faults.set(Delay(1.0), NEXT)
    assert not peers[0].faulted
    peers += [Somebody(), Somebody()]
    assert faults.arrives(peers[1], "the next") == 2
    assert faults.arrives(peers[2], "the one behind") == 3
    assert [peer.faulted for peer in peers] == [False, True, False]
    assert list(faults.steps(2, b"done\r\n")) == []


def test_silence_lasts_until_faults_are_cleared() -> None:
    faults, peers = connected(2)
    faults.set(Pass(), 1, 1)
    faults.set(Silence(), 1)
    assert not faults.silences(1), "one reply passes"
    list(faults.steps(1, b"done\r\n"))
    assert faults.silences(1)
    assert not faults.silences(2)
    assert [peer.faulted for peer in peers] == [True, False]
    faults.clear()
    assert not faults.silences(1)
    assert [peer.faulted for peer in peers] == [False, False]
    assert [peer.went_on for peer in peers] == [1, 1]


@pytest.mark.parametrize(("end", "text"), [(Close(), "the end (FIN)"), (Reset(), "the end (RST)")])
def test_connections_end_at_once(end: Close | Reset, text: str) -> None:
    told: list[tuple[str, str]] = []
    faults, peers = connected(3, lambda name, what: told.append((name, what)))
    faults.end(end, 2)
    assert [peer.taken for peer in peers] == [[], [end], []]
    assert told == [("client 2", text)]
    faults.end(end)
    assert [len(peer.taken) for peer in peers] == [1, 2, 1]
    with pytest.raises(Refused, match="no connection 9"):
        faults.end(end, 9)
    with pytest.raises(Refused, match="no connection -1"):
        faults.end(end, NEXT)
