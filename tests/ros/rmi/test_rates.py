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
    assert rates.rates_hz == {"this": rate_hz}


def test_a_rate_may_change_and_skipped_ticks_count() -> None:
    rates = Rates({"this": 100}, 500)
    rates.set("this", 50.0)
    assert sum(len(rates.due()) for _ in range(500)) == 50
    rates.set("this", 0)
    assert rates.rates_hz["this"] == 1
    rates.set("this", 9_000)
    assert rates.rates_hz["this"] == rates.highest_hz == 500
    rates.set("that", 10)
    assert "that" not in rates.rates_hz
    rates.set("this", 1)
    rates.skip(499)
    assert rates.due() == ["this"]
