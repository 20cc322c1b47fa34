"""Files of several robots in one process: the options of each, and faults in the files."""

from __future__ import annotations

from pathlib import Path

from tests.processes import refused, robots


def test_a_file_names_robots_of_different_kinds(tmp_path: Path) -> None:
    (tmp_path / "cells").mkdir()
    (tmp_path / "cells" / "welder.toml").write_text('robot = "lbr_iiwa_14_r820"\n')
    file = tmp_path / "fleet.toml"
    file.write_text(
        """
        [robot.welder]
        cell = "cells/welder.toml"
        clock = "10x"
        [robot.painter]
        robot = "kr_6_r900_sixx"
        protocol = "krc4"
        port = 0
        [robot.both]
        protocol = ["iiwa", "krc4"]
        strict = true
        port = [31000, 31001]
        servo_timeout = 1.5
        record = "both.mcap"
        """
    )
    found = robots("--fleet", str(file), "--clock", "fast", "--exclusive", "--record", "run.mcap")
    assert list(found) == ["welder", "painter", "both"]
    welder, painter, both = found.values()
    assert (welder.cell, welder.port) == (str(tmp_path / "cells/welder.toml"), (30000,))
    assert (painter.robot, painter.port) == ("kr_6_r900_sixx", (0,))
    assert [each.clock for each in found.values()] == ["10x", "fast", "fast"]
    assert [each.strict for each in found.values()] == [False, False, True]
    assert all(each.exclusive for each in found.values())
    assert (both.port, both.servo_timeout_s) == ((31000, 31001), 1.5)
    assert [each.record for each in (welder, painter)] == ["run-welder.mcap", "run-painter.mcap"]
    assert both.record == str(tmp_path / "both.mcap")


WRONG = {
    "": "robot = (missing): expected this key",
    "[robot]": "robot = {}: expected at least one, as [robot.NAME]",
    "rate = 500\n[robot.one]": "rate = 500: expected no key of this name",
    "[robot.'a/b']": "robot.a/b: expected a name of letters, digits, - _ .",
    "[robot.one]\nprot = 1": "robot.one.prot: no such option, did you mean port?",
    "[robot.one]\nlog_level = 'debug'": "robot.one.log_level: expected on the command line",
    "[robot.one]\nport = 65536": "robot.one.port = 65536: expected a whole number from 0 to 65535",
    "[robot.one]\nrate = '500'": "robot.one.rate = '500': expected a whole number",
    "[robot.one]\ncell = 'a.toml'\nrobot = 'b'": "robot.one: --robot: expected no CELL.toml with it",
    "[robot.one": "expected valid TOML",
}


def test_a_wrong_file_is_reported_in_one_line(tmp_path: Path) -> None:
    file = tmp_path / "fleet.toml"
    for text, reason in WRONG.items():
        file.write_text(text)
        line = refused("--fleet", file)
        assert line.startswith(f"iiwa-sim: {file}: {reason}"), line
    file.write_text("[robot.one]\nros2 = true\n[robot.two]\nros2 = true")
    assert refused("--fleet", file).startswith("iiwa-sim: --ros-namespace: expected a different one")
