"""README.md: every block of code in it does what it says."""

from __future__ import annotations

import os
import re
import shlex
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from iiwa_sim import Simulator, cli
from iiwa_sim.cli.parsing import from_command_line, server
from tests.needed import program
from tests.talking import DEADLINE_S

ROOT = Path(__file__).parent.parent
BIN = Path(sys.executable).parent
TEXT = (ROOT / "README.md").read_text()


COMPILED_WITHIN_S = 300.0
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
BLOCKS = [(found[1], found[2]) for found in BLOCK.finditer(TEXT)]


def blocks(language: str) -> list[str]:
    return [code for name, code in BLOCKS if name == language]


def test_the_session_is_answered_as_it_says() -> None:
    for block in blocks("telnet"):
        lines = block.splitlines()
        with (
            Simulator(clock="stepped") as robot,
            socket.create_connection((robot.host, robot.port), timeout=DEADLINE_S) as client,
            client.makefile("r") as replies,
        ):
            for command, reply in zip(lines[::2], lines[1::2], strict=True):
                if reply == "stopped":
                    robot.run_until_stopped()
                client.sendall(f"{command}\r\n".encode())
                assert (command, replies.readline().strip()) == (command, reply)


def test_the_tests_pass(pytester: pytest.Pytester) -> None:
    for block in blocks("python"):
        pytester.makeini("[pytest]\nasyncio_default_fixture_loop_scope = function\n")
        pytester.makepyfile(block)
        result = pytester.runpytest_inprocess("-W", "error")
        result.assert_outcomes(passed=block.count("\ndef test_"))


@pytest.mark.slow
def test_the_program_in_cpp(tmp_path: Path) -> None:
    for block in blocks("cpp"):
        (tmp_path / "main.cpp").write_text(block)
        compiled = [program("c++"), "-std=c++17", "-I", ROOT / "examples", tmp_path / "main.cpp"]
        _done(*compiled, "-o", tmp_path / "main")
        _done(tmp_path / "main")


COMMANDS = [shlex.split(line, comments=True) for block in blocks("sh") for line in block.splitlines()]


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_a_command(words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    match words:
        case ["iiwa-sim", "check", *rest]:
            assert server(rest[0])  # what it finds is shown in tests/check
        case ["iiwa-sim", "plot", file, *_]:
            assert Path(file).exists()  # tests/plot draws it
        case ["iiwa-sim", name, *rest] if name in cli.COMMANDS:
            assert cli.main([name, *rest]) == 0
        case ["iiwa-sim", *rest]:
            from_command_line(rest)
        case ["make", *targets]:
            _done(program("make"), "--directory", ROOT, "--dry-run", *targets)
        case ["docker", "build", "-t", _, "."]:
            assert (ROOT / "Dockerfile").exists()  # what it builds is tried by make image
        case ["docker", "run", *rest]:
            from_command_line(rest[rest.index("iiwa-sim") + 1 :])
        case ["telnet", "localhost", "30000"]:
            pass  # tests/test_telnet.py drives the real one
        case _:
            pytest.fail(f"{' '.join(words)}: expected a command that can be tried")


def _done(*command: str | Path) -> None:
    environment = os.environ | {"PATH": f"{BIN}:{os.environ['PATH']}"}
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=COMPILED_WITHIN_S, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
