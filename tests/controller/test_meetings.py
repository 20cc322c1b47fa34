"""Log lines of contacts of the arm and of bodies fixed to it."""

from __future__ import annotations

from iiwa_sim.controller.limits_watch import report_touches
from tests.world.scenes import GRIPPER, HEAD, TABLE_MM, Scene, down, part, table


def test_contacts_of_a_jaw_are_reported_by_name_and_kind() -> None:
    head = HEAD.replace("radius_mm = 0", "radius_mm = 20") + GRIPPER  # the jaws stand for the sphere
    scene = Scene(part("block", (600, 100, TABLE_MM + 30.0)), table(), head=head)
    top_mm = TABLE_MM + 60.0
    scene.goes(down(600, 100, top_mm + 80.0), straight=False)
    scene.drives(closed=True)
    events: list[str] = []
    touching = set[str]()
    scene.goes(down(600, 100, top_mm - 1.0), 0.05)
    for _ in range(3):
        touching = report_touches(scene.controller.load, touching, events.append)
    assert "jaw 1 touches part 'block'" in events
    assert len(events) == len(set(events)), "each is reported once"
