"""Contact gives nobody energy: scenes of `tests/energy_hunting.py`, which hunts through more of them."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.energy_hunting import ROUNDING, ContactScene, HeldScene
from tests.samples import some

BENT = 0.05
"""So much of the work that was lost may come back where the normal turns by much in a tick, by friction."""


@settings(max_examples=some(250), deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([ContactScene, HeldScene]))
def test_nobody_gets_back_more_than_was_put_in(seed: int, kind: type[ContactScene | HeldScene]) -> None:
    scene = kind(seed)
    found = scene.run()
    assert found.gained <= ROUNDING
    assert found.returned <= (BENT if scene.bent else ROUNDING)
