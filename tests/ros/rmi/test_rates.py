"""Messages that recur, at rates of simulated time."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.ros.rmi.rates import Rates


@given(rate_hz=st.integers(1, 2_000), tick_rate_hz=st.sampled_from([100, 250, 500, 1_000]))
def test_each_is_due_as_often_as_its_rate_says_and_no_more_than_once_a_tick(
    rate_hz: int, tick_rate_hz: int
) -> None:
    rates = Rates({"this": rate_hz, "never": 0}, tick_rate_hz)
    told = [rates.due() for _ in range(3 * tick_rate_hz)]
    assert sum(map(len, told)) == 3 * min(rate_hz, tick_rate_hz)
    assert rates.names == ("this",)


def test_skipped_ticks_count() -> None:
    rates = Rates({"this": 1}, 500)
    rates.skip(499)
    assert rates.due() == ["this"]
