"""`iiwa-sim plot`: its options, its messages, its exit codes."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from iiwa_sim.cli import main
from iiwa_sim.plot import draw
from tests.plot.scripts import EXAMPLE, EXAMPLES, LIN, TABLE
from tests.processes import IIWA_SIM, ended


@pytest.fixture
def moves(tmp_path: Path) -> Path:
    path = tmp_path / "moves.txt"
    path.write_text(f"{LIN}\nwait stopped\nlin move : 9000 0 0 0 0 0 1 0\n")
    return path


def told_by(arguments: list[str | Path], capsys: pytest.CaptureFixture[str]) -> str:
    """The one line on stderr with which it ends."""
    try:
        code = main(["plot", *map(str, arguments)])
    except SystemExit as ended:
        code = int(str(ended.code))
    out, err = capsys.readouterr()
    assert code == 2
    assert out == ""
    assert re.fullmatch(r"iiwa-sim( plot)?: [^\n]+\n", err)
    assert err[:-1].isprintable()
    assert len(err) < 500
    return err


@pytest.mark.slow
def test_as_a_process(tmp_path: Path) -> None:
    output = tmp_path / "picture.svg"
    done = ended([*IIWA_SIM, "plot", EXAMPLE, "-o", output, "--robot", "lbr_iiwa_14_r820", "--rate", "100"])
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert output.read_text().startswith("<?xml")


def test_a_picture_in_process(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "picture.PNG"
    assert main(["plot", str(EXAMPLE), "-o", str(output), "--rate", "100"]) == 0
    assert capsys.readouterr() == ("", "")
    assert output.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_example_in_its_cell(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output, without = tmp_path / "picture.svg", tmp_path / "without.svg"
    probing = str(EXAMPLES / "probing.txt")
    assert main(["plot", probing, "--cell", str(TABLE), "-o", str(output), "--rate", "100"]) == 0
    assert main(["plot", str(EXAMPLE), "-o", str(without), "--rate", "100"]) == 0
    assert capsys.readouterr() == ("", "")
    assert "force at the TCP" in output.read_text()
    assert "force at the TCP" not in without.read_text()


def test_a_cell_that_cannot_be_used(moves: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cell = tmp_path / "cell.toml"
    cell.write_text("start_deg = 7")
    told = told_by([moves, "-o", "p.png", "--cell", cell], capsys)
    assert told == f"iiwa-sim: {cell}: start_deg = 7: expected a string or an array, not an integer\n"
    told = told_by([moves, "-o", "p.png", "--cell", cell, "--robot", "lbr_iiwa_7_r800"], capsys)
    assert "argument --robot: expected no cell with it, which names its robot" in told


def test_a_refused_command_leaves_no_picture(
    moves: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "picture.png"
    told = told_by([moves, "-o", output], capsys)
    where = f"iiwa-sim: {moves}: line 3: 'lin move : 9000 0 0 0 0 0 1 0': error: "
    assert told.startswith(where)
    assert "out of reach" in told
    assert not output.exists()


@pytest.mark.parametrize("name", ["picture.pdf", "picture", ".png", "png", "picture.png.gz"])
def test_an_unknown_extension(name: str, moves: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = told_by([moves, "-o", name], capsys)
    assert f"argument -o/--output: '{name}' does not end in .png or .svg" in told


def test_a_file_that_is_not_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    told = told_by([tmp_path / "moves.txt", "-o", "picture.png"], capsys)
    assert "moves.txt: cannot be read: No such file or directory" in told


def test_a_picture_that_cannot_be_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(draw, "picture", lambda *_: b"")  # which takes a second
    told = told_by([EXAMPLE, "-o", tmp_path / "missing" / "picture.png"], capsys)
    assert "picture.png: cannot be written: No such file or directory" in told


def test_a_robot_that_is_not_there(moves: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "expected a folder, or one of" in told_by([moves, "-o", "p.png", "--robot", "r2"], capsys)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([], "the following arguments are required: COMMANDS|FILE.mcap"),
        (["moves.txt"], "expected -o PICTURE, --animate FILM, or both"),
        (["moves.txt", "--animate", "p.png"], "--animate: 'p.png' does not end in .gif, .mp4 or .html"),
        (["moves.txt", "-o", "p.png", "--rate", "99"], "argument --rate: '99' is not a whole number"),
        (["moves.txt", "-o", "p.png", "--port", "1"], "unrecognized arguments: --port 1"),
    ],
)
def test_wrong_arguments(arguments: list[str | Path], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert told in told_by(arguments, capsys)


def test_without_matplotlib(
    moves: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in sys.modules if name.startswith(("matplotlib", "iiwa_sim.plot"))]:
        if name not in ("iiwa_sim.plot", "iiwa_sim.plot.fault"):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    told = told_by([moves, "-o", "picture.png"], capsys)
    assert told == "iiwa-sim: a picture needs matplotlib: pip install 'iiwa-sim[plot]'\n"


def test_help_tells_of_plot(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "1000")
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "  plot  " in capsys.readouterr().out
    with pytest.raises(SystemExit) as caught:
        main(["plot", "--help"])
    assert caught.value.code == 0
    assert "'wait SECONDS' and 'wait stopped'" in capsys.readouterr().out
