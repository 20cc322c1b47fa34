"""Parts from STL files: the convex hull of their triangles falls, lies, is gripped and weighed."""

from __future__ import annotations

import struct
from itertools import product
from pathlib import Path

import pytest

from iiwa_sim.cell.settings import CellFault
from tests.cell.cells import cell_from
from tests.stepped import SteppedRobot
from tests.world.scenes import CLOSE, GRIPPER, HEAD, Scene, down, table

MESH = """
[[part]]
name = "it"
shape = "mesh"
mesh = "block.stl"
mass_kg = 0.5
x_mm = 550
y_mm = -100
z_mm = 300
"""
Triangle = tuple[tuple[float, ...], ...]


def block(x: float = 40.0, y: float = 40.0, z: float = 60.0) -> list[Triangle]:
    """Return the triangles of a box that stands on the origin of its frame (mm)."""
    found: list[Triangle] = []
    size = (x, y, z)
    for axis, side in product(range(3), (0, 1)):
        a, b = (k for k in range(3) if k != axis)
        corners = []
        for u, v in ((0, 0), (1, 0), (1, 1), (0, 1)):
            corner = [0.0, 0.0, 0.0]
            corner[axis], corner[a], corner[b] = side * size[axis], u * size[a], v * size[b]
            corners.append((corner[0] - 0.5 * x, corner[1] - 0.5 * y, corner[2]))
        found += [(corners[0], corners[1], corners[2]), (corners[0], corners[2], corners[3])]
    return found


def binary(triangles: list[Triangle]) -> bytes:
    rows = (
        struct.pack("<12f2x", 0.0, 0.0, 0.0, *(n for corner in each for n in corner)) for each in triangles
    )
    return bytes(80) + len(triangles).to_bytes(4, "little") + b"".join(rows)


def test_a_mesh_lies_and_is_carried(tmp_path: Path) -> None:
    (tmp_path / "block.stl").write_bytes(binary(block()))
    scene = object.__new__(Scene)
    scene.robot = SteppedRobot(cell=cell_from(tmp_path, HEAD + GRIPPER + MESH + table()))
    scene.controller = scene.robot.controller
    scene.rests()
    assert scene.part("it").frame[:3] == pytest.approx((550.0, -100.0, 299.853), abs=0.005)
    scene.goes(down(550, -100, 420), straight=False)
    scene.goes(down(550, -100, 330))
    scene.controller.io.set_output(CLOSE, True)
    scene.step(2)
    scene.rests()
    scene.goes(down(550, -100, 400))
    scene.step(5)
    assert scene.part("it").state == "held"
    assert scene.force[2] == pytest.approx(0.5 * 9.81, abs=1e-6)
    assert scene.force[3:] == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)


@pytest.mark.parametrize("found", [None, b"nothing", binary(block(z=0.0))])
def test_a_file_without_a_body_is_a_config_error(tmp_path: Path, found: bytes | None) -> None:
    if found is not None:
        (tmp_path / "block.stl").write_bytes(found)
    with pytest.raises(CellFault, match=r"part\[0\].mesh"):
        cell_from(tmp_path, HEAD + GRIPPER + MESH)
