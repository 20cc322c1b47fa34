"""The options of `iiwa-sim`, in process: what is wrong is said before anything starts."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from iiwa_sim.cli import main
from iiwa_sim.log import LEVELS
from iiwa_sim.robot.description import built_in_robots
from tests.processes import refused

EXAMPLES = Path(__file__).parent.parent / "examples"


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--rate", "99"], "argument --rate: '99' is not a whole number from 100 to 1000"),
        (["--clock", "fats"], "argument --clock: 'fats' is not real, a multiple of real time from 0.01x to"),
        (["--port", "65536"], "from 0 to 65535"),
        (["--port", "1,2"], "argument --port: 2 given, expected 1, one for each dialect"),
        (["--dialect", "klingon"], "argument --dialect: 'klingon': expected iiwa or krc4, each at most once"),
        (["--servo-timeout", "0"], "argument --servo-timeout: '0' is not a number of seconds above 0 and up"),
        (["--status-port", "0", "--status-rate", "0"], "argument --status-rate: '0' is not a whole number"),
        (["--status-rate", "50"], "argument --status-rate: expected --status-port with it"),
        (["--dialect", "krc4", "--strict"], "--strict: expected --dialect iiwa with it"),
        (["--reconnect-pause", "-1"], "--reconnect-pause: '-1' is not a number of seconds from 0 to 86400"),
        (["--prot", "1"], "unrecognized arguments: --prot"),
        (["a.toml", "foo\nbar\x1b[2J"], r"unrecognized arguments: foo\nbar\x1b[2J"),
        (["a.toml", "--robot", "lbr_iiwa_7_r800"], "argument --robot: expected no cell with it"),
        (["shwo"], "argument CELL.toml: 'shwo' is no file and no command; did you mean show?"),
        (["--transcript", ""], "argument --transcript: expected a name, not an empty text"),
    ],
)
def test_wrong_arguments_end_with_one_line(
    arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    out, err = capsys.readouterr()
    assert caught.value.code == 2
    assert out == ""
    assert re.fullmatch(r"iiwa-sim: [^\n]+\n", err)
    assert err[:-1].isprintable()
    assert len(err) < 500
    assert told in err


@pytest.mark.parametrize("cell", ["no such.toml", "x" * 5000, "foo\nbar\x1b[2J", ""])
def test_a_cell_that_is_not_there(
    cell: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["check-cell", cell]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert re.fullmatch(r"iiwa-sim: [^\n]+: expected a[^\n]+file[^\n]*\n", err)
    assert err[:-1].isprintable()
    assert len(err) < 300


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([""], "cell: file = '': expected an existing file"),
        (["--robot", ""], "robot: folder = '': expected a folder, or one of "),
    ],
)
def test_no_name_is_said_to_be_none(arguments: list[str], told: str) -> None:
    assert refused(*arguments).startswith(f"iiwa-sim: {told}")


def test_check_cell_tells_what_is_in_a_cell(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check-cell", str(EXAMPLES / "table.toml")]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "box 'table': 20000 N/m, 107.41 mm away\n" in out


def test_a_cell_with_a_robot_of_six_axes_is_right(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "cell.toml").write_text('robot = "kr_6_r900_sixx"\n')
    assert main(["check-cell", str(tmp_path / "cell.toml")]) == 0
    assert "KR 6 R900 sixx" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([], "the following arguments are required: CELL.toml"),
        (["a.toml", "b.toml"], "unrecognized arguments: b.toml"),
        (["--robot", "x", "a.toml"], "unrecognized arguments: --robot"),
    ],
)
def test_check_cell_takes_one_file(
    arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["check-cell", *arguments])
    _, err = capsys.readouterr()
    assert caught.value.code == 2
    assert re.fullmatch(r"iiwa-sim check-cell: [^\n]+\n", err)
    assert told in err


def test_the_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert re.fullmatch(r"iiwa-sim \d+\.\d+\.\d+\S*\n", capsys.readouterr().out)


def test_help_names_the_robots_that_come_along(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["--help"])
    assert caught.value.code == 0
    out = capsys.readouterr().out
    assert all(robot in out for robot in built_in_robots())


def test_help_tells_ranges_defaults_and_levels(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "1000")
    with pytest.raises(SystemExit):
        main(["--help"])
    out = capsys.readouterr().out
    assert "ticks per second, 100 to 1000 (default: 500)" in out
    assert "(default: 30000 for iiwa, 54600 for krc4)" in out
    assert "above 0 and up to 86400 (default: never)" in out
    assert "False" not in out
    assert all(f"{level}: " in out for level in LEVELS)
    assert out.endswith(" To talk to it: telnet HOST PORT, then help\n")
