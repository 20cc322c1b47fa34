"""What is drawn of an arm is where the arm is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.frames import IDENTITY, Transform
from iiwa_sim.robot.description import RobotFault, built_in_robots, load_robot
from iiwa_sim.robot.model import GREY, Model, Shape
from iiwa_sim.view.drawing import Drawing
from iiwa_sim.view.meshes import joined, mesh_of

JOINTS = st.lists(st.floats(-3.0, 3.0), min_size=7, max_size=7)
BY_FILE = """<robot name="two"><link name="base"/>
<link name="arm"><visual><geometry><mesh filename="arm.stl"/></geometry></visual></link><link name="hand"/>
<joint name="J1" type="revolute"><parent link="base"/><child link="arm"/>
<origin xyz="0 0 0.5"/><axis xyz="0 0 2"/><limit effort="1" velocity="1"/></joint>
<joint name="J2" type="fixed"><parent link="arm"/><child link="hand"/>
<origin xyz="0.3 0.4 0"/></joint></robot>"""


def drawing_of(name: str) -> Drawing:
    robot = load_robot(name)
    return Drawing.of_urdf(robot.urdf, robot.joints, robot.flange)


@pytest.mark.parametrize("name", built_in_robots())
@given(JOINTS)
def test_the_flange_is_drawn_where_it_is(name: str, joints: Sequence[float]) -> None:
    robot, drawing = load_robot(name), drawing_of(name)
    joints = joints[: len(robot.joints)]
    drawn, there = drawing.poses(joints)[drawing.flange], Model(robot).flange(joints)
    assert drawn.translation == pytest.approx(there.translation, abs=1e-12)
    assert drawn.rotation == pytest.approx(there.rotation, abs=1e-12)


@pytest.mark.parametrize("name", built_in_robots())
def test_each_moving_link_has_shapes(name: str) -> None:
    drawing = drawing_of(name)
    links = zip(drawing.links, drawing.shapes, strict=True)
    assert all(shapes for link, shapes in links if link.joint is not None)


def test_what_is_in_files_is_drawn_as_rods() -> None:
    drawing = Drawing.of_urdf(BY_FILE, ["J1"], "hand")
    assert [[shape.size_m for shape in shapes] for shapes in drawing.shapes] == [
        [(0.03, 0.5)],
        [(0.03, 0.5)],
        [],
    ]
    points, _, _, _ = joined(drawing.shapes[1])
    along = points @ np.array([0.6, 0.8, 0.0])
    assert (along.min(), along.max()) == pytest.approx((0.0, 0.5))
    assert drawing.poses([np.pi])[2].translation == pytest.approx((-0.3, -0.4, 0.5))


@pytest.mark.parametrize(
    ("urdf", "joints", "flange"),
    [
        ("<robot", ["J1"], "hand"),
        (BY_FILE, ["J1", "J3"], "hand"),
        (BY_FILE, ["J1"], "tool"),
        (BY_FILE.replace("0 0 0.5", "0 0 x"), ["J1"], "hand"),
        ("<robot/>", [], ""),
    ],
)
def test_what_cannot_be_drawn_is_told_in_one_line(urdf: str, joints: list[str], flange: str) -> None:
    with pytest.raises(RobotFault, match=r"^the robot('s URDF)?: [^\n]+$"):
        Drawing.of_urdf(urdf, joints, flange)


TURNED = Transform((0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0), (0.1, 0.2, 0.3))


@pytest.mark.parametrize("pose", [IDENTITY, TURNED])
@pytest.mark.parametrize(
    ("kind", "size", "volume", "least"),
    [
        ("box", (0.1, 0.2, 0.3), 0.006, 0.999),
        ("cylinder", (0.1, 0.5), np.pi * 0.005, 0.98),
        ("sphere", (0.2,), np.pi * 0.032 / 3.0, 0.96),
    ],
)
def test_triangles_close_a_shape_and_look_outwards(
    kind: str, size: tuple[float, ...], volume: float, least: float, pose: Transform
) -> None:
    points, normals, faces = mesh_of(Shape(kind, size, pose, GREY))
    a, b, c = (points[faces[:, corner]] - pose.translation for corner in range(3))
    enclosed = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0
    assert least * volume <= enclosed <= 1.001 * volume
    outward = np.cross(b - a, c - a)
    assert (np.einsum("ij,ij->i", outward, normals[faces[:, 0]]) >= -1e-12).all()
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0)
