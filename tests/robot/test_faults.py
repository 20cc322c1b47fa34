"""A robot's folder with a fault: one line for everything that can be wrong in it."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from iiwa_sim.robot.description import RobotFault, load_robot
from iiwa_sim.robot.model import arm_model
from iiwa_sim.simulator import Simulator
from tests.processes import refused
from tests.robot.arms import IIWAS, copy_of_robot, edit, use


def in_toml(old: str, new: str) -> Callable[[Path], None]:
    return lambda folder: edit(folder / "robot.toml", old, new)


def in_urdf(old: str, new: str) -> Callable[[Path], None]:
    return lambda folder: edit(folder / "robot.urdf", old, new)


def without(file: str) -> Callable[[Path], None]:
    return lambda folder: (folder / file).unlink()


def a_pipe(folder: Path) -> None:
    (folder / "robot.toml").unlink()
    os.mkfifo(folder / "robot.toml")


CYLINDER = '<cylinder radius="0.098" length="0.115"/></geometry></collision>'
BOX = '<box size="0.22 0.2 0.03"/></geometry></collision>'
LOOKS = '<visual><origin xyz="0 0 0.015"/><geometry><box size="0.22 0.2 0.03"/></geometry>'
AT_A1 = '<origin xyz="0 0 0.15"/>'
AXIS = '<axis xyz="0 0 1"/>'
LIMIT = '<limit lower="-2.967059728" upper="2.967059728" effort="176" velocity="1.710422667"/>'
A2 = 'name="A2" type="revolute">'
BASE = "link iiwa_link_0"
RADIUS, SIZE = f"{BASE}: collision: cylinder radius", f"{BASE}: collision: box size"
PLACE_A1, LIMIT_A1 = "joint A1: origin xyz", "joint A1: limit"
FLANGE = '"flange_media_126"  #'
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
    (AT_A1, AT_A1.replace("0.15", "0,15"), PLACE_A1, "0 0 0,15"),
    (AT_A1, AT_A1.replace("0 0 0.15", "0 0"), PLACE_A1, "0 0"),
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
FAULTS = [
    # the change, then the file, key and value that the line names
    (without("robot.toml"), "robot.toml", "", ""),
    (a_pipe, "robot.toml", "", ""),
    (in_toml("home_deg = [", "home_deg = ["[:-1]), "robot.toml", "", ""),
    (in_toml("per_s = 15.0", "per_s = 'x'"), "robot.toml", "stop.rate_per_s", "'x'"),
    (in_toml("x_mm = 150", ""), "robot.toml", "tool_in_flange.x_mm", r"\(missing\)"),
    (in_toml("x_mm = 150", "x_mm = 0\nw = 2"), "robot.toml", "tool_in_flange.w", "2"),
    (in_toml("[0, 30,", "[30,"), "robot.toml", "home_deg", r"\[30.*\]"),
    (in_toml("[0, 30,", "[0, 121,"), "robot.toml", r"home_deg\[1\]", "121.0"),
    (in_toml("[-170,", "[170,"), "robot.toml", r"limits.position_min_deg\[0\]", "170.0"),
    (in_toml("per_s = 15.0", "per_s = 9"), "robot.toml", "stop.rate_per_s", "9.0"),
    (in_toml('name = "', 'name = "\\u001b'), "robot.toml", "name", r"'\\x1bLBR.*'"),
    (in_toml('"srs"', '"magic"'), "robot.toml", "kinematics", "'magic'"),
    (in_toml('"A2"', '"A1"'), "robot.toml", "joints", r"\['A1', 'A1'.*"),
    (in_toml(FLANGE, '"nose"  #'), "robot.toml", "flange", "'nose'"),
    (in_urdf("</robot>", ""), "robot.urdf", "", ""),
    (in_urdf(AT_A1, AT_A1.replace("0.15", "1e200")), "robot.urdf", "joint A1: origin xyz", "0 0 1e200"),
    (in_urdf('"0 -1 0"', '"0 1 0"'), "robot.urdf", "joint A4: axis", "0 1 0"),
    *(
        (in_urdf(part, mistake), "robot.urdf", re.escape(key), f"{re.escape(value)}.*")
        for part, mistake, key, value in MISTAKES
    ),
]


@pytest.mark.parametrize(("spoil", "file", "key", "value"), FAULTS)
def test_a_fault_is_one_line_with_place_and_reason(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    spoil: Callable[[Path], None],
    file: str,
    key: str,
    value: str,
) -> None:
    folder = copy_of_robot(tmp_path / "mine")
    spoil(folder)
    with pytest.raises(RobotFault) as fault:
        use(folder)
    place = f"({key}) = ({value})" if key else ""
    pattern = f"{re.escape(str(folder / file))}: {place}{': ' if key else ''}expected ."
    assert re.match(pattern, str(fault.value)), str(fault.value)
    assert str(fault.value).isprintable()
    assert len(str(fault.value)) < len(str(folder / file)) + 600
    assert fault.value.__suppress_context__ or fault.value.__context__ is None
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("folder", ["", "/no/such/arm", "x" * 300, "/tmp" + "/x" * 5000, "no\0such"])
def test_an_unusable_folder(folder: str) -> None:
    with pytest.raises(RobotFault, match=r"^robot .*: expected a folder, or one of .*iiwa_7") as fault:
        use(folder)
    assert str(fault.value).isprintable()
    assert len(str(fault.value)) < 400


@pytest.mark.parametrize(
    "text",
    ["nonsense", "", "<robot name='x'><link", "<a>" * 100_000, "<!DOCTYPE a>\n<?xml version='1.0'?>\n<a/>"],
    ids=["nonsense", "empty", "truncated", "deep", "doctype first"],
)
def test_a_urdf_that_is_not_xml_is_reported_by_the_simulator(tmp_path: Path, text: str) -> None:
    """The simulator reads the limits in it first."""
    folder = copy_of_robot(tmp_path / "robot")
    (folder / "robot.urdf").write_text(text)
    with pytest.raises(RobotFault, match=r"robot\.urdf: expected valid XML \(.*\)$") as fault:
        Simulator(folder)
    assert "\n" not in str(fault.value)


def test_the_program_ends_with_the_line_of_the_fault(tmp_path: Path) -> None:
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
