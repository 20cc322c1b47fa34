"""A robot's folder with a fault: one line for everything that can be wrong in it."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from iiwa_sim.robot.description import RobotFault, load_robot
from iiwa_sim.robot.urdf import differing_limits
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


def a_folder(folder: Path) -> None:
    (folder / "robot.urdf").unlink()
    (folder / "robot.urdf").mkdir()


A2 = '<child link="iiwa_link_2"/>\n    <origin xyz="0 0 0.19"/>\n    <axis xyz="0 1 0"/>'
AT_A1 = '<origin xyz="0 0 0.15"/>'
METRES, KILOGRAMS = "3 numbers from -100 to 100 m$", r"a number from 0 to 1e\+06 kg$"
FAULTS = [
    # the change, then file, key, value and what was expected
    (without("robot.toml"), "robot.toml", "", "", "this file in the robot's folder"),
    (without("robot.urdf"), "robot.urdf", "", "", "this file in the robot's folder"),
    (a_pipe, "robot.toml", "", "", "a regular file"),
    (a_folder, "robot.urdf", "", "", "a regular file"),
    (in_toml("home_deg = [", "home_deg = ["[:-1]), "robot.toml", "", "", r"valid TOML \(.*line"),
    (
        in_toml("rate_per_s = 15.0", "rate_per_s = 'x'"),
        "robot.toml",
        "stop.rate_per_s",
        "'x'",
        "a number, not a string",
    ),
    (
        in_toml("[170,", "[true,"),
        "robot.toml",
        r"limits.position_max_deg\[0\]",
        "True",
        "a number, not a boolean",
    ),
    (in_toml("x_mm = 150", ""), "robot.toml", "tool_in_flange.x_mm", r"\(missing\)", "this key"),
    (in_toml("home_deg", "hme_deg"), "robot.toml", "home_deg|hme_deg", ".*", "this key|no key of this name"),
    (
        in_toml("x_mm = 150", "x_mm = 150\nw = 2"),
        "robot.toml",
        "tool_in_flange.w",
        "2",
        "no key of this name",
    ),
    (in_toml("x_mm = 150", "x_mm = nan"), "robot.toml", "tool_in_flange.x_mm", "nan", "a number from -10000"),
    (in_toml("[0, 30,", "[30,"), "robot.toml", "home_deg", r"\[30.*\]", "7 values, one per joint"),
    (in_toml("[0, 30,", "[inf, 30,"), "robot.toml", r"home_deg\[0\]", "inf", "a number from -720 to 720 deg"),
    (in_toml("[0, 30,", "[0, 121,"), "robot.toml", r"home_deg\[1\]", "121.0", "within A2's -120 to 120 deg"),
    (
        in_toml("[98,", "[0,"),
        "robot.toml",
        r"limits.velocity_deg_per_s\[0\]",
        "0.0",
        "a number from 0.01 to 10000 deg/s",
    ),
    (in_toml("[176,", "[-1,"), "robot.toml", r"limits.torque_nm\[0\]", "-1.0", "a number from 0.01 to"),
    (in_toml("[-170,", "[170,"), "robot.toml", r"limits.position_min_deg\[0\]", "170.0", "less than .*, 170"),
    (
        in_toml("per_s = 5.0", "per_s = inf"),
        "robot.toml",
        "limits.acceleration_per.*",
        "inf",
        "a number from",
    ),
    (
        in_toml("rate_per_s = 15.0", "rate_per_s = 9"),
        "robot.toml",
        "stop.rate_per_s",
        "9.0",
        ".*a stop within 100 ms.*126",
    ),
    (
        in_toml("per_s = 10.0", "per_s = 4.9"),
        "robot.toml",
        "direct.acceleration_per_velocity_per_s",
        "4.9",
        "at least that of limits, 5 1/s",
    ),
    (
        in_toml("per_s = 50.0", "per_s = 12.4"),
        "robot.toml",
        "direct.jerk_per_acceleration_per_s",
        "12.4",
        r"at least 12\.5 1/s, for a jerk of at least that of limits",
    ),
    (
        in_toml("[direct]", "[drect]"),
        "robot.toml",
        "direct|drect",
        ".*",
        "this key|no key of this name",
    ),
    *(
        (
            in_toml(old, new),
            "robot.toml",
            re.escape(key),
            re.escape(str(value)),
            f"a number from .* to .*{unit}$",
        )
        for old, new, key, value, unit in (
            ("[98,", "[1e-320,", "limits.velocity_deg_per_s[0]", 1e-320, " deg/s"),
            ("[98,", "[10001,", "limits.velocity_deg_per_s[0]", 10001.0, " deg/s"),
            ("[176,", "[1e6,", "limits.torque_nm[0]", 1e6, " Nm"),
            ("[-170,", "[-721,", "limits.position_min_deg[0]", -721.0, " deg"),
            ("per_s = 5.0", "per_s = 1e308", "limits.acceleration_per_velocity_per_s", 1e308, " 1/s"),
            ("per_s = 25.0", "per_s = 1e-3", "limits.jerk_per_acceleration_per_s", 1e-3, " 1/s"),
            ("per_s = 10.0", "per_s = 1e308", "direct.acceleration_per_velocity_per_s", 1e308, " 1/s"),
            ("per_s = 50.0", "per_s = 1e-3", "direct.jerk_per_acceleration_per_s", 1e-3, " 1/s"),
            ("x_mm = 150", "x_mm = 1e308", "tool_in_flange.x_mm", 1e308, " mm"),
            ("beta = 1.5708", "beta = 90", "tool_in_flange.beta", 90.0, " rad"),
            ("rate_per_s = 15.0", "rate_per_s = 1e9", "stop.rate_per_s", 1e9, " 1/s"),
            ("per_s2 = 600.0", "per_s2 = 1e9", "stop.rate_change_per_s2", 1e9, r" 1/s\^2"),
        )
    ),
    (
        in_toml("x_mm = 150", "x_mm = " + "9" * 5000),
        "robot.toml",
        "",
        "",
        "whole numbers of at most 4300 digits",
    ),
    (
        in_toml("x_mm = 150", "x_mm = 0x" + "f" * 5000),
        "robot.toml",
        "tool_in_flange.x_mm",
        "a very long int",
        "a number of less than 309 digits",
    ),
    (
        in_toml("x_mm = 150", "x_mm = " + "9" * 4000),
        "robot.toml",
        "tool_in_flange.x_mm",
        r"9{20,}\.\.\.9{20,}",
        "a number of less than 309 digits",
    ),
    (in_toml('name = "', "x = " + "[" * 2000 + '\nname = "'), "robot.toml", "", "", "fewer lists and tables"),
    (
        in_toml('name = "', "x = " + "{a=" * 2000 + '\nname = "'),
        "robot.toml",
        "",
        "",
        "fewer lists and tables",
    ),
    (
        in_toml('name = "', ".".join("a" * 3000) + ' = 1\nname = "'),
        "robot.toml",
        "a",
        ".*",
        "no key of this name",
    ),
    (
        in_toml('name = "', f'{"k" * 300} = 1\nname = "'),
        "robot.toml",
        r"k+\.\.\.k+",
        "1",
        "no key of this name",
    ),
    (
        in_toml('name = "', '"name[x] - at `$.q[z]`" = 1\nname = "'),
        "robot.toml",
        r"name\[x\] - at `\$.q\[z\]`",
        "1",
        "no key of this name",
    ),
    (in_toml('name = "', 'name = "\\u001b'), "robot.toml", "name", r"'\\x1bLBR.*'", "characters that print"),
    (
        in_toml('name = "', 'name = "' + "x" * 100),
        "robot.toml",
        "name",
        r"'x+\.\.\..*'",
        "at most 100 characters",
    ),
    (
        in_urdf('<parent link="iiwa_link_6"/>', '<parent link="iiwa_link_5"/>'),
        "robot.urdf",
        "joint A7: parent",
        "moved by A5",
        "a link that A6 moves",
    ),
    (in_toml('"srs"', '"magic"'), "robot.toml", "kinematics", "'magic'", "'srs'"),
    (in_toml('"A2"', '"A1"'), "robot.toml", "joints", r"\['A1', 'A1'.*", "each joint once"),
    (
        in_toml('"A1", "A2"', '"A2", "A1"'),
        "robot.toml",
        "joints",
        r"\['A2', 'A1'.*",
        "the movable joints of .*urdf",
    ),
    (
        in_toml('"flange_media_126"  #', '"nose"  #'),
        "robot.toml",
        "flange",
        "'nose'",
        "a link of .*robot.urdf",
    ),
    (in_toml('"flange_media_126"  #', '"A7"  #'), "robot.toml", "flange", "'A7'", "a link of .*robot.urdf"),
    (
        in_toml('"flange_media_126"  #', '"iiwa_link_3"  #'),
        "robot.toml",
        "flange",
        "'iiwa_link_3'",
        ".*fixed to .*A7",
    ),
    (in_urdf("</robot>", ""), "robot.urdf", "", "", r"valid XML \("),
    (
        in_urdf('<child link="iiwa_link_2"/>', '<child link="no"/>'),
        "robot.urdf",
        "",
        "",
        "a URDF that Pinocchio can read",
    ),
    (
        in_urdf('name="A2" type="revolute"', 'name="A2" type="prismatic"'),
        "robot.urdf",
        "joint A2: type",
        ".*",
        "a revolute",
    ),
    (
        in_urdf('name="A2" type="revolute"', 'name="A2" type="continuous"'),
        "robot.urdf",
        "joint A2: type",
        ".*",
        "a revolute",
    ),
    *(
        (in_urdf(old, new), "robot.urdf", key, value, expected)
        for old, new, key, value, expected in (
            (AT_A1, AT_A1.replace("0.15", "1e200"), "joint A1: origin xyz", "0 0 1e200", METRES),
            (AT_A1, AT_A1.replace("0.15", "-inf"), "joint A1: origin xyz", "0 0 -inf", METRES),
            (AT_A1, AT_A1.replace(" 0.15", ""), "joint A1: origin xyz", "0 0", METRES),
            (AT_A1, AT_A1.replace("0.15", "0,15"), "joint A1: origin xyz", "0 0 0,15", METRES),
            (AT_A1, AT_A1[:-2] + ' rpy="nan 0 0"/>', "joint A1: origin rpy", "nan 0 0", "3 numbers .* rad$"),
            (AT_A1, AT_A1 + '<mimic joint="A2"/>', "joint A1: mimic", "A2", "no joint that follows another"),
            ('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>', "joint A1: axis xyz", "0 0 0", "a direction"),
            (
                'mass value="3.5"',
                'mass value="-1"',
                "link iiwa_link_1: inertial: mass value",
                "-1",
                KILOGRAMS,
            ),
            (
                'mass value="3.5"',
                'mass value="nan"',
                "link iiwa_link_1: inertial: mass value",
                "nan",
                KILOGRAMS,
            ),
            (
                'mass value="3.5"',
                'mass value="1e7"',
                "link iiwa_link_1: inertial: mass value",
                "1e7",
                KILOGRAMS,
            ),
            (
                'ixx="0.021"',
                'ixx="nan"',
                "link iiwa_link_0: inertial: inertia ixx",
                "nan",
                "a number .* kg m",
            ),
            ('ixy="0"', 'ixy="inf"', "link iiwa_link_0: inertial: inertia ixy", "inf", "a number .* kg m"),
            ('"0 0 0.075"', '"0 0 1e9"', "link iiwa_link_0: inertial: origin xyz", "0 0 1e9", METRES),
            ('"0 0 0.015"', '"0 0 nan"', "link iiwa_link_0: visual: origin xyz", "0 0 nan", METRES),
        )
    ),
    (
        in_urdf('xyz="0 -1 0"', 'xyz="0 1 0"'),
        "robot.urdf",
        "joint A4: axis",
        "0 1 0",
        "at zero pose 0 -1 0 in the base",
    ),
    (
        in_urdf('lower="-2.967059728"', 'lower="nan"'),
        "robot.urdf",
        "joint A1: limit lower",
        "nan",
        "a number from -inf to inf rad",
    ),
    (
        in_urdf(A2, A2.replace('"0 0 0.19"', '"0.01 0 0.19"')),
        "robot.urdf",
        "joint A2: origin",
        "0.01 0 0.34 m",
        "an axis through",
    ),
    (
        in_urdf('xyz="0 0 0.046"', 'xyz="0 0.02 0.046"'),
        "robot.urdf",
        "link flange_media_126: origin",
        "0 0.02 1.266 m",
        "x = y = 0",
    ),
]


@pytest.mark.parametrize(("spoil", "file", "key", "value", "expected"), FAULTS)
def test_a_fault_is_one_line_that_says_where_and_what(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    spoil: Callable[[Path], None],
    file: str,
    key: str,
    value: str,
    expected: str,
) -> None:
    folder = copy_of_robot(tmp_path / "mine")
    spoil(folder)
    with pytest.raises(RobotFault) as fault:
        use(folder)
    place = f"({key}) = ({value})" if key else ""
    pattern = f"{re.escape(str(folder / file))}: {place}{': ' if key else ''}expected .*({expected})"
    assert re.match(pattern, str(fault.value)), str(fault.value)
    assert str(fault.value).isprintable()
    assert len(str(fault.value)) < len(str(folder / file)) + 600
    assert fault.value.__suppress_context__ or fault.value.__context__ is None
    assert capfd.readouterr() == ("", "")


def test_a_robot_that_is_not_there() -> None:
    with pytest.raises(
        RobotFault, match=r"robot: folder = /no/such/arm: expected .*lbr_iiwa_7_r800"
    ) as fault:
        use("/no/such/arm")
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize("folder", ["", "x" * 300, "/tmp" + "/x" * 5000, "no\0such"])
def test_a_folder_that_cannot_be(folder: str) -> None:
    with pytest.raises(RobotFault, match=r"^robot: folder = .*: expected a folder, or one of ") as fault:
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


def test_the_simulator_tells_of_them_in_its_log(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    folder = copy_of_robot(tmp_path / "robot")
    in_urdf('effort="110" velocity="1.745329252"', 'effort="110" velocity="9"')(folder)
    Simulator(folder)
    assert "joint A3: limit velocity is 9 rad/s" in caplog.text
