"""What the log tells when the arm, or what it wears, begins to touch something."""

from __future__ import annotations

import pytest

from iiwa_sim.controller.limits_watch import TouchLog
from tests.world.scenes import GRIPPER, HEAD, TABLE_MM, Scene, down, part, table


@pytest.mark.parametrize(
    ("radius_mm", "who", "low_mm"), [(0, "jaw 1", -1.0), (20, "the sphere round the TCP", 18.0)]
)
def test_what_a_jaw_or_the_sphere_meets_is_told_by_name_and_kind(
    radius_mm: int, who: str, low_mm: float
) -> None:
    head = HEAD.replace("radius_mm = 0", f"radius_mm = {radius_mm}") + GRIPPER
    scene = Scene(part("block", (600, 100, TABLE_MM + 30.0)), table(), head=head)
    top_mm = TABLE_MM + 60.0
    scene.goes(down(600, 100, top_mm + 80.0), straight=False)
    scene.drives(closed=True)
    told: list[str] = []
    meetings = TouchLog(scene.controller.load, told.append)
    scene.goes(down(600, 100, top_mm + low_mm), 0.05)
    for _ in range(3):
        meetings.after_tick()
    assert f"{who} touches part 'block'" in told
    assert len(told) == len(set(told)), "each is told once"
