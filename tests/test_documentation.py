"""README.md and docs/: each block of code does what the page says.

A block in `sh` is a list of commands, in `telnet` a session, in `python` tests, a program or a module. A line
`# NAME.py` at its head names the file of a block. Blocks with the same name are one file. A block with
`MyDriver`, the driver of a reader, does not run.
"""

from __future__ import annotations

import os
import re
import shlex
import socket
import subprocess
import sys
import tomllib
from collections import defaultdict
from pathlib import Path

import pytest

from iiwa_sim import Simulator, cli
from iiwa_sim.cli.parsing import from_command_line, server
from tests.line_client import DEADLINE_S
from tests.peers import program

ROOT = Path(__file__).parent.parent
BIN = Path(sys.executable).parent
COMPILED_WITHIN_S = 300.0
PAGES = {path.stem: path.read_text() for path in (ROOT / "README.md", *sorted(ROOT.glob("docs/*.md")))}
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
BLOCKS = [(page, *found.groups()) for page, text in PAGES.items() for found in BLOCK.finditer(text)]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"].keys()
NOT_READ = {
    *("telnet", "mkdir", "cd", "python3", "pytest", "echo", "g++", "docker", "kubectl"),
    *("sudo", "apt", "source", "export", "rosmaster", "rostopic", "ros2"),
}
"""Programs whose arguments are not read. `make nightly` runs the image and ROS, test_telnet.py telnet."""


def blocks(language: str) -> list[tuple[str, str]]:
    return [(page, code) for page, name, code in BLOCKS if name == language]


@pytest.mark.parametrize("block", [code for _, code in blocks("telnet")])
def test_a_session_has_the_documented_replies(block: str) -> None:
    lines = block.splitlines()
    with (
        Simulator(clock="stepped") as robot,
        socket.create_connection((robot.host, robot.port), timeout=DEADLINE_S) as client,
        client.makefile("r") as replies,
    ):
        for command, reply in zip(lines[::2], lines[1::2], strict=True):
            if reply == "stopped" or command == "get error":
                robot.run_until_stopped()
            client.sendall(f"{command}\r\n".encode())
            assert (command, replies.readline().strip()) == (command, reply)


@pytest.mark.parametrize("page", sorted({page for page, _ in blocks("python")}))
def test_the_programs_of_a_page(page: str, pytester: pytest.Pytester) -> None:
    """Tests pass; other blocks run beside a robot in the place of the one on port 30000."""
    files: dict[str, str] = defaultdict(str)
    codes = [code for name, code in blocks("python") if name == page and "MyDriver" not in code]
    for number, code in enumerate(codes):
        named = re.match(r"# (\w+\.py)\n", code)
        kind = "test" if "def test_" in code else "program"
        files[named[1] if named else f"{kind}_{number}.py"] += code
    for name, code in files.items():
        (pytester.path / name).write_text(code)
    for name, code in files.items():
        if name.startswith("program_"):
            with Simulator(clock="fast", protocol=["iiwa", "krc4"]) as robot:
                ports = {"30000": robot.ports["iiwa"], "54600": robot.ports["krc4"]}
                for port, real in ports.items():
                    code = code.replace(f'"127.0.0.1", {port}', f'"127.0.0.1", {real}')
                exec(compile(code, f"{page}: {name}", "exec"), {})
    pytester.makeini("[pytest]\nasyncio_default_fixture_loop_scope = function\n")
    expected = sum(code.count("\ndef test_") + code.startswith("def test_") for code in files.values())
    if expected:
        pytester.runpytest_inprocess("-W", "error").assert_outcomes(passed=expected)


@pytest.mark.slow
@pytest.mark.parametrize("block", [code for _, code in blocks("cpp")])
def test_a_program_in_cpp(block: str, tmp_path: Path) -> None:
    (tmp_path / "main.cpp").write_text(block)
    compiled = [program("c++"), "-std=c++17", "-I", ROOT / "examples", tmp_path / "main.cpp"]
    _done(*compiled, "-o", tmp_path / "main")
    _done(tmp_path / "main")


LINES = [line for _, block in blocks("sh") for line in block.replace("\\\n", " ").splitlines()]
COMMANDS = sorted({tuple(shlex.split(part, comments=True)) for line in LINES for part in line.split(" && ")})


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_a_command(words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for folder in ("examples", "robots", "protocol"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    monkeypatch.chdir(tmp_path)
    match [words[0].removeprefix(".venv/bin/"), *words[1:]]:
        case ["iiwa-sim", "check", *rest]:
            assert server(rest[0])  # what it finds is shown in tests/check
        case ["iiwa-sim", "plot" | "show" | "replay" as name, file, *_]:
            assert name in cli.COMMANDS
            assert Path(file).exists() or file in ("run.mcap", "session.txt")
        case ["iiwa-sim", name, *rest] if name in cli.COMMANDS:
            with pytest.raises(SystemExit, match="0"):
                cli.main([name, "--help"])
        case ["iiwa-sim", *rest]:
            from_command_line([word for word in rest if word != "&"])
        case ["make", *targets]:
            _done(program("make"), "--directory", ROOT, "--dry-run", *targets)
        case ["curl", *rest]:
            token = "swordfish" if "Authorization" in " ".join(rest) else None
            with Simulator(cell="examples/table.toml", backdoor_port=0, backdoor_token=token) as robot:
                at = f"127.0.0.1:{robot.backdoor_port}"
                here = [re.sub(r"^(localhost|robot\.local):30002", at, word) for word in rest]
                _done(program("curl"), "--silent", "--show-error", "--fail", *here)
        case ["docker", "run", *rest] if "iiwa-sim" in rest:
            from_command_line(rest[rest.index("iiwa-sim") + 1 :])
        case ["pip", "install", *rest]:
            assert {*re.findall(r"\[(\w+)\]", " ".join(rest))} <= EXTRAS
        case [python, file, *_] if python.endswith("python") and file.startswith("examples/"):
            assert Path(file).exists()  # tests/ros and tests/test_tutorial.py run them
        case [other, *_] if other in NOT_READ:
            pass
        case _:
            pytest.fail(f"{' '.join(words)}: expected a command that can be tried")


def _done(*command: str | Path) -> None:
    environment = os.environ | {"PATH": f"{BIN}:{os.environ['PATH']}"}
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=COMPILED_WITHIN_S, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
