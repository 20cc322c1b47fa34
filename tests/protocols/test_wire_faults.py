"""Effects of wire faults on replies, without sockets."""

from __future__ import annotations

from types import SimpleNamespace

from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.protocols.faults import Garble, WireFaults

REPLIES = st.lists(st.binary(max_size=12).map(lambda b: bytes(32 + x % 95 for x in b) + b"\r\n"), max_size=8)


@given(replies=REPLIES, seed=st.integers(0, 2**32 - 1))
def test_a_garbled_reply_keeps_its_line_end_and_depends_on_the_seed(replies: list[bytes], seed: int) -> None:
    garbled = []
    for _ in range(2):
        faults = WireFaults()
        faults.arrives(SimpleNamespace(), "a driver")
        faults.seed(seed)
        faults.set(Garble())
        (rule,) = faults.rules
        garbled.append([step for reply in replies for step in faults.steps(1, rule, reply)])
    assert garbled[0] == garbled[1]
    assert [len(each) for each in garbled[0]] == [len(each) for each in replies]
    for was, now in zip(replies, garbled[0], strict=True):
        assert now.endswith(b"\r\n")
        assert all(a != b and 33 <= b <= 126 for a, b in zip(was[:-2], now[:-2], strict=True))
