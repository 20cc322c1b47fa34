"""The options of `iiwa-sim`, in process: what is wrong is said before anything starts."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from iiwa_sim.cli import main

EXAMPLES = Path(__file__).parent.parent / "examples"


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


def test_check_cell_tells_what_is_in_a_cell(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check-cell", str(EXAMPLES / "table.toml")]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "box 'table': 20000 N/m, 107.41 mm away\n" in out


def test_the_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert re.fullmatch(r"iiwa-sim \d+\.\d+\.\d+\S*\n", capsys.readouterr().out)
