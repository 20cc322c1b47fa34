"""Completion in a real shell."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from iiwa_sim.cli import main
from tests.needed import program
from tests.talking import DEADLINE_S

ASK = 'source "$1"; COMP_WORDS=("${@:2}"); COMP_CWORD=$(($# - 2)); _shtab_iiwa_sim; echo "${COMPREPLY[@]}"'


@pytest.mark.parametrize(
    ("words", "completed"),
    [
        (["--cl"], ["--clock"]),
        (["repl"], ["replay"]),
        (["check", "--allow"], ["--allow-motion"]),
        (["--log-level", "w"], ["warning"]),
    ],
)
def test_bash_completes(
    words: list[str], completed: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["completion", "bash"]) == 0
    script = tmp_path / "iiwa-sim"
    script.write_text(capsys.readouterr().out)
    done = subprocess.run(
        [program("bash"), "-c", ASK, "bash", script, "iiwa-sim", *words],
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
        check=True,
    )
    assert done.stdout.split() == completed


def test_zsh_has_a_script_of_its_own(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", "zsh"]) == 0
    assert capsys.readouterr().out.startswith("#compdef iiwa-sim")


def test_a_shell_that_is_none(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["completion", "fish"])
    assert caught.value.code == 2
    assert "invalid choice: 'fish'" in capsys.readouterr().err
