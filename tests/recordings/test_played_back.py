"""What was recorded plays back to the same joint positions at every tick, bit for bit."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.recordings.sessions import MOST_COMMANDS, check_session
from tests.samples import some


@settings(max_examples=some(15))
@given(seed=st.integers(0, 2**32), commands=st.integers(1, MOST_COMMANDS))
def test_random_sessions(seed: int, commands: int) -> None:
    check_session(seed, commands)
