"""Meshes of links: the ones that a URDF names, and the generated ones of the built-in robots."""

from __future__ import annotations

from pathlib import Path

import pytest

from iiwa_sim.robot.meshes import link_meshes
from tools.make_meshes import ROBOTS, links_of

URDF = """<robot name="two"><link name="base"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
<link name="arm"><visual><origin xyz="0 0 0.1" rpy="0 0 1.5707963"/>
<geometry><mesh filename="{}" scale="0.001 0.001 0.002"/></geometry></visual></link></robot>"""


@pytest.mark.parametrize("urdf", sorted(ROBOTS.glob("*/robot.urdf")), ids=lambda urdf: urdf.parent.name)
def test_the_meshes_of_built_in_robots_are_generated_byte_by_byte(urdf: Path, tmp_path: Path) -> None:
    found = link_meshes(urdf.read_text(), str(urdf))
    links = links_of(urdf)
    assert list(found) == list(links)
    for name, link in links.items():
        link.save(tmp_path / name)
        (mesh,) = found[name]
        assert mesh.path.read_bytes() == (tmp_path / name).read_bytes()


@pytest.mark.parametrize("name", ["../meshes/arm.stl", "package://my_arm/meshes/arm.stl"])
def test_a_mesh_is_found_as_the_urdf_names_it(name: str, tmp_path: Path) -> None:
    for folder in ("my_arm/urdf", "my_arm/meshes"):
        (tmp_path / folder).mkdir(parents=True)
    file = tmp_path / "my_arm" / "meshes" / "arm.stl"
    urdf = str(tmp_path / "my_arm" / "urdf" / "robot.urdf")
    assert link_meshes(URDF.format(name), urdf) == {}, "a file that is missing"
    file.touch()
    ((link, (mesh,)),) = link_meshes(URDF.format(name), urdf).items()
    assert (link, mesh.path.resolve(), mesh.scale) == ("arm", file, (0.001, 0.001, 0.002))
    assert mesh.pose.translation == pytest.approx((0.0, 0.0, 0.1))
    assert mesh.pose.rotation == pytest.approx((0, -1, 0, 1, 0, 0, 0, 0, 1), abs=1e-6)
