"""The scene shows the arm where it is, with its shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
import viser
from hypothesis import given
from hypothesis import strategies as st

from iiwa_sim.recordings.scene import Arm
from iiwa_sim.robot.description import RobotDescription, built_in_robots, load_robot
from iiwa_sim.robot.model import Model
from iiwa_sim.view.scene import Scene

ARMS = {name: Arm(load_robot(name)) for name in built_in_robots()}
JOINTS = st.lists(st.floats(-2.0, 2.0), min_size=7, max_size=7)
URDF = """<robot name="two"><link name="base"/>
<link name="arm"><visual><origin xyz="0 0 0.1"/><geometry><mesh filename="arm.stl" scale="1 1 2"/></geometry>
<material name="red"><color rgba="1 0 0 1"/></material></visual></link><link name="hand"/>
<joint name="J1" type="revolute"><parent link="base"/><child link="arm"/>
<origin xyz="0 0 0.5"/><axis xyz="0 0 2"/><limit effort="1" velocity="1"/></joint>
<joint name="J2" type="fixed"><parent link="arm"/><child link="hand"/>
<origin xyz="0.3 0.4 0"/></joint></robot>"""


def robot_of(urdf: str, path: Path, flange: str = "hand") -> RobotDescription:
    own = {"joints": ("J1",), "flange": flange, "urdf": urdf, "urdf_path": str(path)}
    return replace(load_robot(), capsules_mm=(), **own)


class Nodes:
    """A scene of viser that remembers what is added to it."""

    def __init__(self) -> None:
        self.added: list[tuple[str, str, tuple[Any, ...], dict[str, Any]]] = []

    def __getattr__(self, kind: str) -> Any:
        getattr(viser.SceneApi, kind)

        def add(name: str, *values: Any, **options: Any) -> Any:
            self.added.append((kind, name, values, options))
            return type("Node", (), {"name": name})()

        return add


@pytest.mark.parametrize("name", ARMS)
@given(joints=JOINTS)
def test_the_flange_is_drawn_where_it_is(name: str, joints: Sequence[float]) -> None:
    robot, arm = load_robot(name), ARMS[name]
    joints = joints[: len(robot.joints)]
    index = [link.name for link in arm.links].index(robot.flange)
    drawn, there = arm.poses(joints)[index], Model(robot).flange(joints)
    assert drawn.translation == pytest.approx(there.translation, abs=1e-12)
    assert drawn.rotation == pytest.approx(there.rotation, abs=1e-12)


def test_links_have_their_meshes_else_rods(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(URDF)

    def looks() -> dict[str, tuple[str, tuple[Any, ...], dict[str, Any]]]:
        nodes: Any = Nodes()
        Scene(nodes, robot_of(URDF, path))
        return {name.removeprefix("/robot/arm/"): (kind, *rest) for kind, name, *rest in nodes.added}

    rods = looks()
    _, _, options = rods["base/0"]
    assert (options["height"], options["position"][2]) == pytest.approx((0.5, 0.25))
    kind, _, options = rods["arm/0"]
    assert (kind, options["height"]) == ("add_cylinder", pytest.approx(0.5))
    assert "hand/0" not in rods
    trimesh.creation.box((0.2, 0.2, 0.2)).export(tmp_path / "arm.stl")
    kind, (vertices, _), options = looks()["arm/0"]
    assert (kind, options["color"], options["position"]) == ("add_mesh_simple", (255, 0, 0), (0.0, 0.0, 0.1))
    assert np.ptp(vertices, axis=0) == pytest.approx([0.2, 0.2, 0.4])
