"""Text of others, as it comes into a message."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.wording import distinct, harmless


@given(st.text("a \n\r\x1b\u2028\u202e\udcff\u00e4"))
def test_harmless_text_is_one_line_that_prints(text: str) -> None:
    assert harmless(text).isprintable()
    assert harmless(text) == text or not text.isprintable()


def test_unprintable_text_is_escaped() -> None:
    assert harmless("a\nb\x1b\u2028\udcff\u202e\u00e4") == r"a\nb\x1b\u2028\udcff\u202e" + "\u00e4"


@given(st.floats(-7, 7), st.floats(-7, 7))
def test_a_number_is_distinct_from_its_limits(value: float, limit: float) -> None:
    shown, at_limit = distinct(value, limit)
    assert (float(shown) == float(at_limit)) == (value == limit)


def test_digits_are_added_only_near_a_limit() -> None:
    assert distinct(9, -2.967059728, 2.967059728) == ["9", "-2.96706", "2.96706"]
    assert distinct(2.96705975, 2.967059728) == ["2.9670598", "2.9670597"]
