"""`iiwa-sim plot`: its options, its messages, its exit codes."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from iiwa_sim.cli import main
from tests.plot.test_run import LIN

EXAMPLE = Path(__file__).parents[2] / "examples" / "blending.txt"


@pytest.fixture
def moves(tmp_path: Path) -> Path:
    path = tmp_path / "moves.txt"
    path.write_text(f"{LIN}\nwait stopped\nlin move : 9000 0 0 0 0 0 1 0\n")
    return path


def message_of(arguments: list[str | Path], capsys: pytest.CaptureFixture[str]) -> str:
    """Return the one line on stderr with which the command ends."""
    try:
        code = main(["plot", *map(str, arguments)])
    except SystemExit as ended:
        code = int(str(ended.code))
    out, err = capsys.readouterr()
    assert (code, out, err.count("\n")) == (2, "", 1)
    return err


def test_a_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "picture.PNG"
    assert main(["plot", str(EXAMPLE), "-o", str(output), "--rate", "100"]) == 0
    assert capsys.readouterr() == ("", "")
    assert output.read_bytes().startswith(b"\x89PNG")


def test_a_refused_command_leaves_no_picture(
    moves: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    message = message_of([moves, "-o", tmp_path / "picture.png"], capsys)
    assert message.startswith(f"iiwa-sim: {moves}: line 3: 'lin move : 9000 0 0 0 0 0 1 0': 3021 the TCP at ")
    assert not (tmp_path / "picture.png").exists()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["moves.txt"], "the following arguments are required: -o/--output"),
        (["moves.txt", "-o", "p.pdf"], "-o/--output: p.pdf does not end in .png or .svg"),
        (["none.txt", "-o", "p.png"], "none.txt: cannot be read: No such file or directory"),
        (["m.txt", "-o", "p.png", "--robot", "r2"], "expected a folder, or one of"),
        (["m.txt", "-o", "p.png", "--robot", "r2", "--cell", "c.toml"], "expected no CELL.toml with it"),
        (["run.mcap", "-o", "p.png", "--rate", "500"], "--rate: expected none with a recording"),
    ],
)
def test_wrong_arguments(arguments: list[str | Path], text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert text in message_of(arguments, capsys)


def test_without_matplotlib(
    moves: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in sys.modules if name.startswith(("matplotlib", "iiwa_sim.plot.draw"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    message = message_of([moves, "-o", "picture.png"], capsys)
    assert message == f"iiwa-sim: this needs matplotlib: {sys.executable} -m pip install 'iiwa-sim[plot]'\n"
