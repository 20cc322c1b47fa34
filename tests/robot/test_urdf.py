"""A mistake in a URDF ends with one line that names the element, the value and what was expected."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from iiwa_sim.robot.description import RobotFault, load_robot
from iiwa_sim.robot.model import arm_model
from tests.processes import refused
from tests.robot.arms import IIWAS, copy_of_robot, edit, use

CYLINDER = '<cylinder radius="0.098" length="0.115"/></geometry></collision>'
BOX = '<box size="0.22 0.2 0.03"/></geometry></collision>'
LOOKS = '<visual><origin xyz="0 0 0.015"/><geometry><box size="0.22 0.2 0.03"/></geometry>'
ORIGIN = '<origin xyz="0 0 0.15"/>'
AXIS = '<axis xyz="0 0 1"/>'
LIMIT = '<limit lower="-2.967059728" upper="2.967059728" effort="176" velocity="1.710422667"/>'
A2 = 'name="A2" type="revolute">'
BASE = "link iiwa_link_0"
RADIUS, SIZE = f"{BASE}: collision: cylinder radius", f"{BASE}: collision: box size"
AT_A1, LIMIT_A1 = "joint A1: origin xyz", "joint A1: limit"

MISTAKES = [
    # a part of the URDF, what stands in its place, and key and value in the message
    (CYLINDER, CYLINDER.replace("0.098", "0,098"), RADIUS, "0,098"),
    (CYLINDER, CYLINDER.replace("0.098", "${r}"), RADIUS, "${r}"),
    (CYLINDER, CYLINDER.replace("0.098", "nan"), RADIUS, "nan"),
    (CYLINDER, CYLINDER.replace("0.098", "-0.1"), RADIUS, "-0.1"),
    (CYLINDER, CYLINDER.replace('radius="0.098" ', ""), RADIUS, "(missing)"),
    (CYLINDER, CYLINDER.replace("cylinder", "cone"), f"{BASE}: collision: geometry", "cone"),
    (BOX, BOX.replace("0.22 0.2 0.03", "0.22 0.2"), SIZE, "0.22 0.2"),
    (BOX, BOX.replace("0.22", "inf"), SIZE, "inf 0.2 0.03"),
    (BOX, "</geometry></collision>", f"{BASE}: collision: geometry", "(missing)"),
    (LOOKS, LOOKS.replace("0.22", "0,22"), f"{BASE}: visual: box size", "0,22 0.2 0.03"),
    (LOOKS, LOOKS.replace("0 0 0.015", "0 0 ${z}"), f"{BASE}: visual: origin xyz", "0 0 ${z}"),
    ("0.25 0.25 0.27 1", "0.25 0.25 0,27 1", "robot: material: color rgba", "0.25 0.25 0,27 1"),
    (ORIGIN, ORIGIN.replace("0.15", "0,15"), AT_A1, "0 0 0,15"),
    (ORIGIN, ORIGIN.replace("0 0 0.15", "0 0"), AT_A1, "0 0"),
    (AXIS, AXIS.replace("1", "0"), "joint A1: axis xyz", "0 0 0"),
    (AXIS, AXIS + '<dynamics damping="0,5"/>', "joint A1: dynamics damping", "0,5"),
    ('<mass value="4.8"/>', '<mass value="-4.8"/>', f"{BASE}: inertial: mass value", "-4.8"),
    ('ixx="0.01458"', 'ixx="nan"', "link iiwa_link_1: inertial: inertia ixx", "nan"),
    (LIMIT, "", LIMIT_A1, "(missing)"),
    (LIMIT, LIMIT.replace("1.710422667", "fast"), f"{LIMIT_A1} velocity", "fast"),
    *((A2, A2.replace("revolute", kind), "joint A2: type", kind) for kind in ("continuous", "floating")),
    (A2, A2 + '<mimic joint="A1"/>', "joint A2: mimic", "A1"),
    ('<parent link="iiwa_link_1"/>', "", "joint A2: parent link", "(missing)"),
    (
        '<parent link="iiwa_link_0"/>',
        '<parent link="iiwa_link_7"/>',
        "link iiwa_link_1",
        "iiwa_link_1 > iiwa_link_7 > ",
    ),
    ('<child link="iiwa_link_2"/>', '<child link="iiwa_link_1"/>', "joint A2: child link", "iiwa_link_1"),
    ("</robot>", '<link name="other"/></robot>', "link", "iiwa_link_0, other"),
    ("</robot>", '<link name="iiwa_link_2"/></robot>', "link iiwa_link_2: name", "iiwa_link_2"),
    ('<joint name="A3"', '<joint name="A2"', "joint A2: name", "A2"),
]


@pytest.mark.parametrize(("part", "mistake", "key", "value"), MISTAKES)
def test_a_mistake_is_one_line_with_element_and_value(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], part: str, mistake: str, key: str, value: str
) -> None:
    folder = copy_of_robot(tmp_path / "mine")
    edit(folder / "robot.urdf", part, mistake)
    with pytest.raises(RobotFault) as fault:
        use(folder)
    message = str(fault.value)
    assert re.match(re.escape(f"{folder}/robot.urdf: {key} = {value}"), message), message
    assert re.search(r": expected \S", message)
    assert message.isprintable()
    assert capfd.readouterr() == ("", "")


def test_the_program_ends_with_that_line(tmp_path: Path) -> None:
    folder = copy_of_robot(tmp_path / "mine")
    edit(folder / "robot.urdf", CYLINDER, CYLINDER.replace("0.098", "0,098"))
    line = refused("--port", "0", "--robot", str(folder))
    assert f"{RADIUS} = 0,098: expected a number from 1e-06 to 100 m" in line


@pytest.mark.parametrize("name", IIWAS)
def test_links_have_the_shapes_of_the_urdf(name: str) -> None:
    robot = load_robot(name)
    links = arm_model(robot).links
    assert sum(len(link.collision) for link in links) == robot.urdf.count("<collision>")
    assert sum(len(link.visual) for link in links) == robot.urdf.count("<visual>")
    shape = links[0].collision[0]
    assert (shape.kind, shape.size_m, shape.pose.translation) == ("box", (0.22, 0.2, 0.03), (0.0, 0.0, 0.015))


def test_meshes_are_left_out(tmp_path: Path) -> None:
    folder = copy_of_robot(tmp_path / "mine")
    mesh = '<visual><geometry><mesh filename="package://arm/link.stl"/></geometry></visual></link>'
    edit(folder / "robot.urdf", "</link>", mesh)
    assert arm_model(use(folder)).links[0].visual == arm_model(load_robot()).links[0].visual
