"""The last seconds of values, at even times."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.view.charts import EVERY_S, SAMPLES, Samples


def test_a_value_holds_from_its_time_on_to_the_next() -> None:
    samples = Samples(1)
    samples.add(0.0 * EVERY_S, [1.0])
    samples.add(3.5 * EVERY_S, [2.0])
    samples.add(5.2 * EVERY_S, [3.0])
    assert samples.columns()[0, -6:].tolist() == [0.0, 2.0, 2.0, 2.0, 3.0, 3.0]


@given(st.lists(st.floats(0.0, 1e5), max_size=20))
def test_there_are_always_as_many_whatever_the_times(times: list[float]) -> None:
    samples = Samples(2)
    for time_s in times:
        samples.add(time_s, [1.0, 2.0])
    assert samples.columns().shape == (2, SAMPLES)


def test_time_that_goes_back_or_far_ahead_begins_anew() -> None:
    for later in (0.0, SAMPLES * EVERY_S + 20.0):
        samples = Samples(1)
        samples.add(10.0, [5.0])
        samples.add(later, [0.0])
        assert not samples.columns().any()
