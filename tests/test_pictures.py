"""The pictures of docs/ that are drawn from the simulator can be drawn, and show what they say."""

from pathlib import Path

import numpy as np

from benchmarks.corners import corners
from docs import draw_corner


def test_the_corner_of_the_page_on_motion_can_be_drawn(tmp_path: Path) -> None:
    draw_corner.draw(tmp_path / "corner.svg")
    assert (tmp_path / "corner.svg").read_text().startswith("<?xml")
    assert "](corner.svg)" in draw_corner.PICTURE.with_name("motion.md").read_text()


def test_it_shows_the_corner_passed_at_speed_and_the_stop() -> None:
    corner = next(each for each in corners(draw_corner.ROBOT) if each.name == "named R60 v1")
    passed, stopping = draw_corner.passed(corner), draw_corner.passed(corner, blending=False)
    nearest = int(np.linalg.norm(stopping.places, axis=1).argmin())
    assert stopping.speeds[nearest - 1] < 20.0
    middle = slice(len(passed.speeds) // 4, -len(passed.speeds) // 4)
    assert passed.speeds[middle].min() > 200.0
