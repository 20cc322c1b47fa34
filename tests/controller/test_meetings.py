"""What the log tells when the arm, or what it wears, begins to touch something."""

from __future__ import annotations

from dataclasses import replace

import pytest

from iiwa_sim.cell.cell import robot_alone
from iiwa_sim.controller.meetings import Meetings
from tests.handling.scenes import BLOCK, TABLE_MM, Scene, at, down


@pytest.mark.parametrize(
    ("radius_m", "who", "low_mm"), [(0.0, "jaw 1", -1.0), (0.02, "the sphere round the TCP", 18.0)]
)
def test_what_a_jaw_or_the_sphere_meets_is_told_by_name_and_kind(
    radius_m: float, who: str, low_mm: float
) -> None:
    cell = replace(robot_alone(), contact_radius_m=radius_m)
    scene = Scene((BLOCK, at(600, 100, TABLE_MM + 30.0)), cell=cell)
    top_mm = TABLE_MM + 60.0
    scene.goes(down(600, 100, top_mm + 80.0), straight=False)
    scene.closes()
    told: list[str] = []
    meetings = Meetings(scene.controller.load, scene.controller.tick_s, told.append)
    scene.goes(down(600, 100, top_mm + low_mm), 0.05)
    for tick in range(3):
        meetings.after_tick(tick, moved=True)
    assert f"{who} touches part 'block'" in told
    assert len(told) == len(set(told)), "each is told once"
