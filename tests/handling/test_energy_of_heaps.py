"""Parts that fall on, beside and into parts, and are pushed by an arm: nothing comes from nowhere.

Random scenes by a seed on the stepped robot; `tools/hunt.py` tries more of them.
"""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.handling.books import ROUNDING_J
from tests.handling.heaps import HeapScene, heap, row
from tests.samples import some

BENT = 0.02
"""Part of the arm's work: that is found by the forces at the end of each tick, and a corner that slides round
a jaw is pushed another way then than at the beginning."""


def falls(seed: int) -> dict[str, float]:
    """Nobody pushes: all goes straight down, and rests."""
    scene = heaped(seed)
    scene.falls()
    return check(scene)


def ploughs(seed: int) -> dict[str, float]:
    """The same, and then an arm goes through it."""
    scene = heaped(seed)
    scene.falls()
    scene.goes_through()
    return check(scene)


def rows(seed: int, *, stacks: bool = False) -> dict[str, float]:
    """Parts that stand beside each other, and an arm that goes through them."""
    rng = np.random.default_rng(seed)
    scene = HeapScene(rng, row(rng, stacks=stacks))
    scene.goes_through()
    return check(scene)


def stacks(seed: int) -> dict[str, float]:
    """The same with parts on top of them."""
    return rows(seed, stacks=True)


def heaped(seed: int) -> HeapScene:
    rng = np.random.default_rng(seed)
    return HeapScene(rng, heap(rng))


def check(scene: HeapScene) -> dict[str, float]:
    books = scene.books
    assert books.returned_j <= ROUNDING_J + BENT * books.arm_j, books.told
    return {
        "returned, J": books.returned_j,
        "of the arm's work": books.returned_j / max(books.arm_j, 1e-3),
        "fastest, m/s": scene.fastest,
    }


@settings(max_examples=some(60), deadline=None)
@given(st.integers(0, 10**6))
def test_what_falls_on_beside_and_into_others_goes_straight_down_and_rests(seed: int) -> None:
    """Whatever is lifted, taken away, let go or brought back meanwhile."""
    scene = heaped(seed)
    scene.falls()
    assert scene.fastest < 1e-9, "nobody has pushed"


@settings(max_examples=some(15), deadline=None)
@given(st.integers(0, 10**6))
def test_an_arm_that_goes_through_a_row_gives_all_that_its_parts_get(seed: int) -> None:
    """Motion, height and springs of all parts have no more than the work of the arm, by what it feels."""
    rows(seed)
