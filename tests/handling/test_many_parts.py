"""A cell with very many parts: those that neither move nor are touched are not asked for."""

from __future__ import annotations

from statistics import median
from typing import Any

from iiwa_sim.contact.shapes import Box
from iiwa_sim.contact.surface import Surface
from tests.asked import lin_move
from tests.handling.scenes import BLOCK, CLOSE, TABLE_MM, Scene, at, down

FLOOR = Surface("table", Box(2.0, 2.0, 0.02), at(600.0, 0.0, TABLE_MM - 20.0), 2e4, 0.0, 0.3)


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
