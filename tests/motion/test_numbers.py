"""A set of numbers kept as ranges is the set of these numbers."""

from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.motion.numbers import Numbers

SMALL = st.integers(0, 20)


@given(st.lists(st.one_of(st.lists(SMALL), SMALL)))
def test_it_has_what_was_added_and_not_taken_out(changes: list[list[int] | int]) -> None:
    """A list is added; up to a number all are taken out."""
    numbers, expected = Numbers(), set[int]()
    for change in changes:
        if isinstance(change, int):
            numbers.drop_up_to(change)
            expected = {number for number in expected if number > change}
        else:
            numbers.update(change)
            expected.update(change)
        assert {number for number in range(-1, 23) if number in numbers} == expected
        assert len(numbers) == len({number for number in expected if number - 1 not in expected})
    numbers.clear()
    assert not any(number in numbers for number in range(21))
