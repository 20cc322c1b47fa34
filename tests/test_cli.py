"""The options of `iiwa-sim`, in process: faults are reported before anything starts."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import pytest

from iiwa_sim.cli import COMMANDS, main
from iiwa_sim.cli.parsing import Parser
from iiwa_sim.options.model import NEEDS
from iiwa_sim.options.sources import OPTIONS
from iiwa_sim.robot.description import DEFAULT_ROBOT

MOST_LINES = 80
EXAMPLES = Path(__file__).parent.parent / "examples"


@pytest.mark.parametrize("cell", ["no such.toml", "x" * 5000, "foo\nbar\x1b[2J", ""])
def test_a_missing_cell(
    cell: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["check-cell", cell]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert re.fullmatch(r"iiwa-sim: [^\n]+: expected a[^\n]+file[^\n]*\n", err)
    assert err[:-1].isprintable()
    assert len(err) < 300


def test_check_cell_lists_the_contents_of_a_cell(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check-cell", str(EXAMPLES / "table.toml")]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "box 'table': 107.41 mm away\n" in out


def test_check_cell_tells_a_contact_at_the_start(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (EXAMPLES / "table.toml").read_text().replace("z_mm = 280", "z_mm = 389")
    (tmp_path / "cell.toml").write_text(text)
    assert main(["check-cell", str(tmp_path / "cell.toml")]) == 0
    assert "box 'table': pressed in by 1.59 mm\n" in capsys.readouterr().out


def test_the_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert re.fullmatch(r"iiwa-sim \d+\.\d+\.\d+\S*\n", capsys.readouterr().out)


def helped(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    with pytest.raises(SystemExit) as caught:
        main(words)
    assert caught.value.code == 0
    return capsys.readouterr().out


def test_help_lists_common_options_and_commands_in_any_environment(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("IIWA_SIM_RATE", "none")
    text = helped(capsys, "--help")
    assert text.count("\n") <= MOST_LINES
    flags = {line.split()[0] for line in text.splitlines() if line.startswith("  ")}
    rare = {OPTIONS[key].flag for key in " ".join(NEEDS).split()}
    assert {each.flag for each in OPTIONS.values()} - flags == rare
    assert all(f"\n  {name} " in text for name in COMMANDS)
    assert f"{DEFAULT_ROBOT} if none" in text
    assert "(a whole number from 100 to 1000 Hz; default: 500)" in text
    text = helped(capsys, "--help-all")
    assert all(f"\n  {each.flag}" in text for each in OPTIONS.values())


class CommandLineAccepted(Exception):
    """A command line has been taken."""


def test_the_examples_of_a_command_are_accepted(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = {command: examples(helped(capsys, *command.split(), "--help")) for command in ("", *COMMANDS)}

    def parsed(parser: Parser, words: Sequence[str]) -> NoReturn:
        original(parser, words)
        raise CommandLineAccepted

    original = Parser.parsed
    monkeypatch.setattr(Parser, "parsed", parsed)
    for command, found in lines.items():
        assert found, command
        for line in found:
            with pytest.raises(CommandLineAccepted):
                main(shlex.split(line)[1:])


def examples(text: str) -> list[str]:
    return [
        line.strip().partition("  ")[0] for line in text.splitlines() if line.strip().startswith("iiwa-sim ")
    ]
