"""A robot's folder with a fault: one line for everything that can be wrong in it."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from iiwa_sim.robot.description import RobotFault, load_robot
from iiwa_sim.robot.urdf_check import differing_limits
from iiwa_sim.simulator import Simulator
from tests.robot.arms import copy_of_robot, edit, use


def in_toml(old: str, new: str) -> Callable[[Path], None]:
    return lambda folder: edit(folder / "robot.toml", old, new)


def in_urdf(old: str, new: str) -> Callable[[Path], None]:
    return lambda folder: edit(folder / "robot.urdf", old, new)


def without(file: str) -> Callable[[Path], None]:
    return lambda folder: (folder / file).unlink()


def a_pipe(folder: Path) -> None:
    (folder / "robot.toml").unlink()
    os.mkfifo(folder / "robot.toml")


AT_A1 = '<origin xyz="0 0 0.15"/>'
FLANGE = '"flange_media_126"  #'
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
    (in_urdf('"iiwa_link_2"/>', '"no"/>'), "robot.urdf", "joint A2: child link", "no"),
    (
        in_urdf('name="A2" type="revolute"', 'name="A2" type="prismatic"'),
        "robot.urdf",
        "joint A2: type",
        ".*",
    ),
    (in_urdf(AT_A1, AT_A1.replace("0.15", "1e200")), "robot.urdf", "joint A1: origin xyz", "0 0 1e200"),
    (in_urdf('"0 -1 0"', '"0 1 0"'), "robot.urdf", "joint A4: axis", "0 1 0"),
]


@pytest.mark.parametrize(("spoil", "file", "key", "value"), FAULTS)
def test_a_fault_is_one_line_that_says_where_and_what(
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
def test_a_folder_that_cannot_be(folder: str) -> None:
    with pytest.raises(
        RobotFault, match=r"^robot: folder = .*: expected a folder, or one of .*iiwa_7"
    ) as fault:
        use(folder)
    assert str(fault.value).isprintable()
    assert len(str(fault.value)) < 300


def test_limits_in_the_urdf_that_are_others_are_told(tmp_path: Path) -> None:
    for name in ("lbr_iiwa_7_r800", "lbr_iiwa_14_r820", "kr_6_r900_sixx"):
        assert differing_limits(load_robot(name)) == []
    folder = copy_of_robot(tmp_path / "robot")
    edit(folder / "robot.urdf", '-2.967059728" upper="2.967059728" effort="110"', '-2.9" upper="2.967"')
    (line,) = differing_limits(load_robot(folder))
    told = f"joint A3: limit lower is -2.9 rad, in {folder}/robot.toml -2.96706 rad: the latter holds"
    assert line == f"{folder}/robot.urdf: {told}"


@pytest.mark.parametrize(
    "text",
    ["nonsense", "", "<robot name='x'><link", "<a>" * 100_000, "<!DOCTYPE a>\n<?xml version='1.0'?>\n<a/>"],
    ids=["nonsense", "empty", "truncated", "deep", "doctype first"],
)
def test_a_urdf_that_is_not_xml_is_told_by_the_simulator(tmp_path: Path, text: str) -> None:
    """The simulator looks at the limits in it first of all."""
    folder = copy_of_robot(tmp_path / "robot")
    (folder / "robot.urdf").write_text(text)
    with pytest.raises(RobotFault, match=r"robot\.urdf: expected valid XML \(.*\)$") as fault:
        Simulator(folder)
    assert "\n" not in str(fault.value)
