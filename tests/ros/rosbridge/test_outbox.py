"""What waits for a client of rosbridge."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.ros.rosbridge.outbox import MOST_REPLIES, Outbox


def made(frame: bytes) -> Callable[[], bytes]:
    return lambda: frame


class Client:
    """One whose clock the test turns."""

    def __init__(self) -> None:
        self.woken = 0
        self.now_s = 0.0
        self.outbox = Outbox(self._wake)

    def _wake(self) -> None:
        self.woken += 1

    def takes(self) -> list[bytes]:
        """All that may be sent now."""
        taken = []
        while (message := self.outbox.next(self.now_s).message) is not None:
            taken.append(message)
        return taken


@pytest.fixture
def client() -> Client:
    return Client()


def test_replies_come_in_order_and_before_topics(client: Client) -> None:
    client.outbox.set_feed("/a", 0.0, 1)
    client.outbox.feed("/a", made(b"topic"))
    client.outbox.reply(b"1")
    client.outbox.reply(b"2")
    assert client.woken == 3
    assert client.takes() == [b"1", b"2", b"topic"]


def test_of_a_topic_the_newest_is_kept(client: Client) -> None:
    client.outbox.set_feed("/a", 0.0, 0)
    client.outbox.set_feed("/b", 0.0, 2)
    for number in b"123":
        client.outbox.feed("/a", made(bytes([number])))
        client.outbox.feed("/b", made(bytes([number])))
    assert sorted(client.takes()) == [b"2", b"3", b"3"]


@given(st.lists(st.floats(0.0, 0.3), max_size=60), st.integers(0, 4))
def test_messages_are_no_closer_than_the_throttle(gaps: list[float], queue_length: int) -> None:
    client, sent = Client(), []
    client.outbox.set_feed("/a", 0.5, queue_length)
    for number, gap in enumerate(gaps):
        client.now_s += gap
        client.outbox.feed("/a", made(str(number).encode()))
        sent += [(client.now_s, int(message)) for message in client.takes()]
    while (wait_s := client.outbox.next(client.now_s).wait_s) is not None:
        client.now_s += wait_s
        sent += [(client.now_s, int(message)) for message in client.takes()]
    times = [time for time, _ in sent]
    assert all(b - a >= 0.5 - 1e-9 for a, b in pairwise(times))
    numbers = [number for _, number in sent]
    assert numbers == sorted(set(numbers))
    assert numbers[-1:] == [len(gaps) - 1][: len(gaps)], "the newest is never lost"


def test_a_client_that_does_not_take_its_replies_overflows(client: Client) -> None:
    for _ in range(MOST_REPLIES):
        client.outbox.reply(b"x")
    assert not client.outbox.overflown
    client.outbox.reply(b"x")
    assert client.outbox.overflown
    assert client.takes() == []
    client.outbox.reply(b"x")
    assert client.takes() == []


def test_of_a_slow_client_only_what_is_sent_is_made(client: Client) -> None:
    client.outbox.set_feed("/a", 0.0, 1)
    made_of: list[int] = []

    def making(number: int) -> Callable[[], bytes]:
        def make() -> bytes:
            made_of.append(number)
            return bytes([number])

        return make

    for number in range(100):
        client.outbox.feed("/a", making(number))
    assert client.outbox.next(0.0).message == bytes([99])
    assert client.outbox.next(0.0).message is None
    assert made_of == [99]
