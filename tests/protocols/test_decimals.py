import math
import re

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from iiwa_sim.protocols.decimals import format_decimals, parse_decimal

JAVA_DECIMAL = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
REPLY_NUMBER = re.compile(r"-?[0-9]+\.([0-9]|[0-9]*[1-9])")

words = st.text("0123456789+-.eE_xnaifNIty,d", min_size=1, max_size=8)
finite = st.floats(allow_nan=False, allow_infinity=False)
usual = st.floats(-4000, 4000) | st.integers(-4000, 4000).map(float) | st.floats(-1e-8, 1e-8)


def is_number(word: str) -> bool:
    return bool(JAVA_DECIMAL.fullmatch(word)) and math.isfinite(float(word))


@given(words | st.from_regex(JAVA_DECIMAL, fullmatch=True, alphabet=st.characters(codec="ascii")))
@example("1")
@example("1.")
@example("+.5")
@example("1E-5")
@example("1e999")
@example("1_000")
@example("1,5")
@example("nan")
@example("Infinity")
@example("0x10")
@example(".")
def test_numbers_are_those_of_the_grammar(word):
    if is_number(word):
        assert parse_decimal(word.encode()) == float(word)
    else:
        with pytest.raises(ValueError, match="^" + re.escape(word[:40])):
            parse_decimal(word.encode())


@given(st.lists(usual | finite, min_size=1, max_size=7))
@example([2996925887.5])
@example([-0.0])
@example([-1e-12, 600.0, -math.pi / 2])
@example([1e-6, 1e16, 1e300])
@example([999999.9999999999, 1e6, -1e6])
def test_replies_are_decimals_that_read_back(values):
    written = format_decimals(values).decode("ascii").split(" ")
    assert len(written) == len(values)
    for value, text in zip(values, written, strict=True):
        assert REPLY_NUMBER.fullmatch(text)
        assert text != "-0.0"
        assert abs(float(text) - value) <= 1e-9
