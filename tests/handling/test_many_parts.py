"""A cell with very many parts: those that neither move nor are touched are not asked for, and in a tower none
is asked for by all that it lies on."""

from __future__ import annotations

from statistics import mean, median
from typing import Any

from iiwa_sim.contact.shapes import Box
from iiwa_sim.contact.surface import Surface
from iiwa_sim.handling.falling import FALLS, LIES
from iiwa_sim.handling.part import Part
from tests.asked import lin_move
from tests.handling.scenes import BLOCK, CLOSE, TABLE_MM, Scene, at, down

FLOOR = Surface("table", Box(2.0, 2.0, 0.02), at(600.0, 0.0, TABLE_MM - 20.0), 2e4, 0.0, 0.3)


PLATE_MM = 6.0
PLATE = Part("plate", Box(0.02, 0.02, 0.5e-3 * PLATE_MM), 0.05, 0.5, 5e4)


class Counting(dict[str, Any]):
    """Parts by their names, which counts how often one is asked for."""

    asked = 0

    def __getitem__(self, name: str) -> Any:
        self.asked += 1
        return super().__getitem__(name)


def asked_for(others: int) -> float:
    """How often a part is asked for in a tick in which one of them is pushed, in the middle of all ticks."""
    far = (
        (BLOCK._replace(name=f"far {k}"), at(1300.0 + 60.0 * (k % 8), 60.0 * (k // 8), TABLE_MM + 30.0))
        for k in range(others)
    )
    scene = Scene((BLOCK, at(600.0, 100.0, TABLE_MM + 30.0)), *far, surfaces=(FLOOR,))
    scene.controller.io.set_output(CLOSE, True)
    scene.goes(down(600.0, 60.0, TABLE_MM + 200.0), straight=False)
    scene.goes(down(600.0, 60.0, TABLE_MM + 30.0))
    pieces = scene.handling.workpieces
    assert pieces is not None
    pieces._bodies = counting = Counting(pieces._bodies)
    scene.controller.move(lin_move(down(600.0, 120.0, TABLE_MM + 30.0), 0.1, 0.0))
    counts = []
    while scene.controller.moving:
        before = counting.asked
        scene.robot.step()
        counts.append(counting.asked - before)
    assert scene.body("block").pose.translation[1] > 0.14, "it is pushed"
    return median(counts)


def test_parts_far_away_are_not_asked_for_while_one_is_pushed() -> None:
    assert asked_for(60) == asked_for(2)


def tower(height: int) -> tuple[Scene, Counting]:
    """A tower of plates, and closed jaws beside it; with a count of the parts that are asked for."""
    plates = (
        (PLATE._replace(name=f"plate {k}"), at(600.0, 100.0, TABLE_MM + PLATE_MM * (k + 0.5)))
        for k in range(height)
    )
    scene = Scene(*plates, surfaces=(FLOOR,))
    scene.controller.io.set_output(CLOSE, True)
    scene.goes(down(600.0, 40.0, TABLE_MM + 200.0), straight=False)
    scene.goes(down(600.0, 40.0, TABLE_MM + 8.0))
    pieces = scene.handling.workpieces
    assert pieces is not None
    pieces._bodies = counting = Counting(pieces._bodies)
    return scene, counting


def asked_for_as_it_is_pushed(height: int) -> float:
    """How often a part of a tower is asked for in a tick in which that goes, in the mean of these ticks."""
    scene, counting = tower(height)
    scene.controller.move(lin_move(down(600.0, 130.0, TABLE_MM + 8.0), 0.1, 0.0))
    counts = []
    while scene.controller.moving:
        before = counting.asked
        scene.robot.step()
        asked = counting.asked - before
        if len(scene.handling.workpieces.moving) == 1:
            counts.append(asked)
    top = scene.body(f"plate {height - 1}")
    assert top.state == LIES
    assert top.pose.translation[1] > 0.11, "it is taken along"
    return mean(counts)


def asked_for_as_it_falls(height: int) -> float:
    """How often a part of a tower is asked for in a tick in which that falls, or lands, at most."""
    scene, counting = tower(height)
    scene.handling.remove("plate 0")
    counts = []
    while any(each.state == FALLS for each in counting.values()):
        before = counting.asked
        scene.robot.step()
        counts.append(counting.asked - before)
    return max(counts)


def test_in_a_tower_that_is_pushed_parts_are_asked_for_no_more_often_the_higher_it_is() -> None:
    """Once each was asked for by all that it lies on, and put anew for each of these."""
    assert asked_for_as_it_is_pushed(24) < 2.3 * asked_for_as_it_is_pushed(12)


def test_in_a_tower_that_falls_parts_are_asked_for_no_more_often_the_higher_it_is() -> None:
    """Once each looked at all others."""
    assert asked_for_as_it_falls(24) < 2.3 * asked_for_as_it_falls(12)
