"""What is told of what recurs, in hand-made time."""

from __future__ import annotations

from collections import Counter

from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.throttle import SECOND_NS, Throttle


@given(
    most=st.integers(1, 5),
    happened=st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, SECOND_NS)), max_size=60),
)
def test_each_is_told_or_counted_once_and_no_more_than_so_many_in_a_second(
    most: int, happened: list[tuple[str, int]]
) -> None:
    now_ns, untold = 0, Counter[str]()
    told: dict[str, list[int]] = {kind: [] for kind in "abc"}
    throttle = Throttle[str](most, lambda kind, number: untold.update({kind: number}))
    for kind, later_ns in happened:
        now_ns += later_ns
        count = throttle.count(kind, now_ns)
        assert count is None or 1 <= count <= most
        if count is not None:
            told[kind].append(now_ns)
    throttle.count("the end", now_ns + SECOND_NS)
    for kind, times_ns in told.items():
        assert len(times_ns) + untold[kind] == sum(each == kind for each, _ in happened)
        for first_ns, behind_ns in zip(times_ns, times_ns[most:], strict=False):
            assert behind_ns > first_ns
