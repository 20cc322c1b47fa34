"""Replies beside those expected."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.transcript.compare import deviation, filled
from iiwa_sim.transcript.lines import Answered, Compare, Step

NUMBERS = st.floats(-1e4, 1e4).map(lambda value: round(value, 6))
HEARD = {"get tool frame": "450.0 0.0 520.5", "get status": "stopped"}


def expected(text: str, compare: Compare, within: float = 0.0) -> Answered:
    return Answered(Step(1, "", None), text, compare, within)


@pytest.mark.parametrize(
    ("text", "reply", "told"),
    [
        ("done", "done", ""),
        ("done", "error", "expected 'done', got 'error'"),
        ("done", "done ", "expected 'done', got 'done '"),
        ("1.0", "1", "expected '1.0', got '1'"),
        ("{get status}", "stopped", ""),
        (r"\x7bget status}", "{get status}", ""),
        ("{get mode}", "stopped", "'get mode' has not been asked yet"),
    ],
)
def test_word_for_word(text: str, reply: str, told: str) -> None:
    assert deviation(expected(text, Compare.EXACT), reply, HEARD) == told


@pytest.mark.parametrize(
    ("text", "reply", "told"),
    [
        ("1 2", "1.0 2.4", ""),
        ("1 2", "1.0 2.6", "number 2 is 2.6, expected 2.0 within 0.5: '1.0 2.6'"),
        ("1 2", "1.0", "expected 2 numbers, got 1: '1.0'"),
        ("1 2", "1 2 3", "expected 2 numbers, got 3: '1 2 3'"),
        ("1 2", "error", "expected '1 2', got 'error': expected numbers"),
        ("the force is 80.5 N", "the force is 81.0 N", ""),
        ("force 1 N", "force 2 N", "expected 'force 1 N', its numbers within 0.5, got 'force 2 N'"),
        ("force 1 N", "force nan N", "expected 'force 1 N', its numbers within 0.5, got 'force nan N'"),
        ("force 1 N", "torque 1 N", "expected 'force 1 N', its numbers within 0.5, got 'torque 1 N'"),
        ("force 1 N", "force 1", "expected 'force 1 N', its numbers within 0.5, got 'force 1'"),
        ("1 2", "1 nan", "expected finite numbers"),
        ("{get tool frame}", "450 0.2 520.1", ""),
        ("{get tool frame + 0 0 10}", "450 0.2 530.1", ""),
        ("{get tool frame + 0 10}", "450 0.2 530.1", "expected 3 numbers behind the +"),
    ],
)
def test_numbers_within_a_tolerance(text: str, reply: str, told: str) -> None:
    found = deviation(expected(text, Compare.NUMBERS, 0.5), reply, HEARD)
    assert found == told if not told else told in found


@given(numbers=st.lists(NUMBERS, min_size=1), others=st.lists(NUMBERS, min_size=1), within=st.floats(0, 1e3))
def test_it_deviates_just_where_a_number_is_off_by_more(
    numbers: list[float], others: list[float], within: float
) -> None:
    text, reply = (" ".join(map(repr, each)) for each in (numbers, others))
    near = len(numbers) == len(others) and all(
        abs(one - other) <= within for one, other in zip(numbers, others, strict=True)
    )
    assert (deviation(expected(text, Compare.NUMBERS, within), reply, {}) == "") == near
    assert deviation(expected(text, Compare.NUMBERS, float("inf")), reply, {}) == "" or len(numbers) != len(
        others
    )


def test_anything_goes() -> None:
    assert deviation(expected("3021 no", Compare.ANY), "0 none", {}) == ""


def test_what_was_heard_is_put_into_a_line() -> None:
    assert filled("lin move : {get tool frame} 0.2", HEARD) == "lin move : 450.0 0.0 520.5 0.2"
    assert filled("{get tool frame + 1 -2 0.5}", HEARD) == "451.000000000 -2.000000000 521.000000000"
    assert filled("{get tool frame 3}", HEARD) == "520.5"
    assert filled("{get tool frame 3 + 1}", HEARD) == "521.500000000"
    assert filled('{"level": 1}', HEARD) == '{"level": 1}'
    for text in ("{get tool frame 4}", "{get tool frame 0}", "{get mode}", "{get status + 1}"):
        with pytest.raises(ValueError, match=r"."):
            filled(text, HEARD)
