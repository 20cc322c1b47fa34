"""What is round and lies on its side is pushed onto what is lower, and does not come into it."""

from __future__ import annotations

from math import pi

import pytest

from iiwa_sim.contact.shapes import Box, Cylinder
from iiwa_sim.frames import Frame, Transform
from iiwa_sim.handling.part import Part
from tests.asked import lin_move
from tests.handling.books import ROUNDING_J, Books
from tests.handling.depths import deepest_mm
from tests.handling.scenes import CLOSE, TABLE_MM, Scene, at, down

ROLLER = Part("roller", Cylinder(0.03, 0.008), 0.3, 0.3, 5e4)
SILL = Part("sill", Box(0.03, 0.01, 0.006), 0.3, 0.5, 5e4)
ROD = Part("rod", Cylinder(0.009, 0.03), 0.2, 0.5, 5e4)


def lying(x_mm: float, y_mm: float, above_mm: float, *, turned: float = 0.0) -> Transform:
    """Of a cylinder on its side: along x of the base, or turned from there about the vertical."""
    return Frame(x_mm, y_mm, TABLE_MM + above_mm, turned, 0.5 * pi, 0.0).to_transform()


AHEAD = {
    "its flank meets the middle of an edge": (SILL, at(600.0, 138.0, TABLE_MM + 6.0)),
    "a thin one lies along it": (ROD, lying(600.0, 140.0, 9.0)),
    "a thin one lies across": (ROD, lying(592.5, 165.0, 9.0, turned=0.5 * pi)),
}


@pytest.mark.parametrize("ahead", AHEAD.values(), ids=AHEAD.keys())
@pytest.mark.parametrize("speed", [0.05, 0.2])
def test_what_is_low_is_pushed_on_by_what_is_round(ahead: tuple[Part, Transform], speed: float) -> None:
    scene = Scene((ROLLER, lying(600.0, 100.0, 30.0)), ahead)
    scene.controller.io.set_output(CLOSE, True)
    scene.goes(down(600.0, 50.0, TABLE_MM + 200.0), straight=False)
    scene.goes(down(600.0, 50.0, TABLE_MM + 30.0))
    books, deepest = Books(scene), 0.0
    scene.controller.move(lin_move(down(600.0, 130.0, TABLE_MM + 30.0), speed, 0.0))
    while scene.controller.moving:
        books.step()
        deepest = max(deepest, deepest_mm(books.pieces))
    assert scene.body("roller").pose.translation[1] > 0.15
    assert deepest < 1.2, "so far a blow presses it in"
    assert books.returned_j <= ROUNDING_J
