"""Widths of cells, whatever there is to be planned for."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from iiwa_sim.motion.timing.widths_kernel import widths

ANY = st.one_of(st.floats(), st.floats(-1.0, 2.0))
NAN, INFINITE = float("nan"), float("inf")


@given(
    st.one_of(st.floats(), st.floats(1e-3, 30.0)),
    st.lists(st.tuples(ANY, ANY), max_size=3),
    st.lists(ANY, max_size=3),
    st.lists(st.one_of(ANY, st.floats(1e-3, 0.1)), max_size=2),
)
@example(1e-308, [], [], [])  # took all memory
@example(1.0, [(0.2, 0.5)], [], [NAN])  # gave NaN
@example(1.0, [(NAN, 0.5), (0.2, NAN), (0.3, INFINITE)], [NAN], [])
def test_numbers_that_are_none_give_no_widths_that_are_none(
    end_s: float, corners: list[tuple[float, float]], events: list[float], first: list[float]
) -> None:
    begins, ends = np.array(corners, dtype=float).reshape(-1, 2).T.copy()
    try:
        found = widths(end_s, begins, ends, np.array(sorted(events)), np.array(first))
    except ArithmeticError:
        return
    assert np.all(np.isfinite(found))
    assert found.sum() == pytest.approx(end_s, rel=1e-6, abs=1e-6 * np.abs(found).max())
