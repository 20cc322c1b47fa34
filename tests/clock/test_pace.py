"""The names of paces."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.clock.pace import FAST, REAL, STEPPED, multiple, pace


@pytest.mark.parametrize("fixed", [REAL, FAST, STEPPED])
def test_a_pace_has_a_name(fixed) -> None:
    assert pace(fixed.name) is fixed


@given(st.integers(1, 10_000).map(lambda hundredths: hundredths / 100))
def test_a_multiple_is_written_with_an_x(speed: float) -> None:
    assert pace(f"{speed}x") == multiple(speed)
    assert pace(f"{speed}x").speed == speed
    assert pace(multiple(speed).name) == multiple(speed)


@pytest.mark.parametrize(
    "name",
    ["", "x", "10", "0x", "0.001x", "101x", "1e1x", "-1x", "nanx", "infx", " 10x", "10X", "Fast", 10, None],
)
def test_anything_else_is_refused_with_what_is_expected(name) -> None:
    with pytest.raises(ValueError, match="expected real, a multiple of real time from"):
        pace(name)
