"""The body of a tool."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest

from iiwa_sim.view.tool import Tool


class Bodies:
    """A scene and the meshes in it, by their nodes."""

    def __init__(self) -> None:
        self.points: dict[str, Any] = {}

    def add_mesh_simple(self, path: str, points: Any, faces: Any, **_: Any) -> Bodies:
        assert faces.max() < len(points)
        self.points[path] = points
        return self

    def remove(self) -> None:
        self.points.clear()


def told(*end_mm: float) -> dict[str, Any]:
    return {"start_mm": [0.0, 0.0, 30.0], "end_mm": [*end_mm], "radius_mm": 25.0}


def test_it_has_the_size_of_its_capsules_and_goes_with_them() -> None:
    bodies = Bodies()
    tool = Tool(cast(Any, bodies), "/flange")
    tool.are([told(40.0, 0.0, 30.0), told(0.0, 0.0, 90.0)])
    (points,) = bodies.points.values()
    assert points.min(axis=0) == pytest.approx((-0.025, -0.025, 0.005), abs=1e-6)
    assert points.max(axis=0) == pytest.approx((0.065, 0.025, 0.115), abs=1e-6)
    tool.are([told(0.0, 0.0, 30.0)])  # a ball
    (points,) = bodies.points.values()
    assert np.linalg.norm(points - [0.0, 0.0, 0.03], axis=1).max() == pytest.approx(0.025, abs=1e-6)
    tool.are([])
    assert not bodies.points
