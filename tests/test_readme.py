"""README.md: short, in short sentences, and every block of code in it does what it says."""

from __future__ import annotations

import os
import re
import shlex
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from iiwa_sim import Simulator
from iiwa_sim.cli import check, main
from iiwa_sim.cli.names import SUBCOMMANDS
from iiwa_sim.cli.server_options import server_parser
from tests.needed import program
from tests.processes import running
from tests.talking import DEADLINE_S

ROOT = Path(__file__).parent.parent
BIN = Path(sys.executable).parent
TEXT = (ROOT / "README.md").read_text()
MOST_LINES, MOST_WORDS, LONGEST_PARAGRAPH = 130, 30, 5
COMPILED_WITHIN_S = 300.0
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
BLOCKS = [(found[1], found[2]) for found in BLOCK.finditer(TEXT)]


def blocks(language: str) -> list[str]:
    return [code for name, code in BLOCKS if name == language]


def paragraphs() -> Iterator[list[str]]:
    """Lines of prose that belong together; each item of a list is one, tables and code are none."""
    lines: list[str] = []
    for line in [*BLOCK.sub("", TEXT).splitlines(), ""]:
        if lines and (not line.strip() or line.startswith(("- ", "#", "|"))):
            yield lines
            lines = []
        if line.strip() and not line.startswith(("#", "|", "![")):
            lines.append(line)


def sentences() -> Iterator[str]:
    for lines in paragraphs():
        text = re.sub(r"\]\([^)]*\)", "]", " ".join(lines))
        yield from re.split(r"(?<=[.:;?!])\s+", text)


def test_it_is_short() -> None:
    assert len(TEXT.splitlines()) <= MOST_LINES
    assert [lines for lines in paragraphs() if len(lines) > LONGEST_PARAGRAPH] == []
    assert [each for each in sentences() if len(each.split()) > MOST_WORDS] == []


def test_each_block_is_of_a_kind_that_is_tried_here() -> None:
    assert {language for language, _ in BLOCKS} == {"sh", "telnet", "python", "yaml", "cpp"}


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
        result = pytester.runpytest_subprocess("-W", "error", timeout=DEADLINE_S)
        result.assert_outcomes(passed=block.count("\ndef test_"))


def test_the_program_in_cpp(tmp_path: Path) -> None:
    for block in blocks("cpp"):
        (tmp_path / "main.cpp").write_text(block)
        compiled = [program("c++"), "-std=c++17", "-I", ROOT / "examples", tmp_path / "main.cpp"]
        _done(*compiled, "-o", tmp_path / "main")
        _done(tmp_path / "main")


def test_the_steps_for_ci_are_of_their_schema_and_of_our_action(tmp_path: Path) -> None:
    for block in blocks("yaml"):
        steps = yaml.safe_load(block)
        job = {"runs-on": "ubuntu-24.04", "steps": steps}
        (tmp_path / "ci.yml").write_text(yaml.safe_dump({"name": "ci", "on": "push", "jobs": {"test": job}}))
        _done(BIN / "check-jsonschema", "--builtin-schema", "vendor.github-workflows", tmp_path / "ci.yml")
        action = yaml.safe_load((ROOT / "action.yml").read_text())
        assert set(steps[0]["with"]) <= set(action["inputs"])
        used = re.findall(rf"steps\.{steps[0]['id']}\.outputs\.(\w+)", block)
        assert used
        assert set(used) <= set(action["outputs"])
        server_parser().parse_args(shlex.split(steps[0]["with"]["options"]))


COMMANDS = [shlex.split(line, comments=True) for block in blocks("sh") for line in block.splitlines()]


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_a_command(words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    match words:
        case ["iiwa-sim", "check", *rest]:
            assert check._parser().parse_args(rest)  # what it finds is shown in tests/check
        case ["iiwa-sim", name, *rest] if name in SUBCOMMANDS:
            assert main([name, *rest]) == 0
        case ["iiwa-sim", *rest]:
            assert server_parser().parse_args(rest)
            if "--view-port" not in rest:  # its page takes a while, and has tests of its own
                with running(*rest):
                    pass
        case ["make", *targets]:
            _done(program("make"), "--directory", ROOT, "--dry-run", *targets)
        case ["docker", "build", "-t", _, "."]:
            assert (ROOT / "Dockerfile").exists()  # what it builds is tried by make image
        case ["docker", "run", *rest]:
            assert server_parser().parse_args(rest[rest.index("iiwa-sim") + 1 :])
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
