"""The example clients, run as a newcomer runs them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from iiwa_sim.simulator import Simulator
from tests.peers import program
from tests.processes import ended

EXAMPLES = Path(__file__).parent.parent / "examples"
STRICT = ("-std=c++17", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror")


def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
    return ended(command)


@pytest.fixture(scope="module")
def cpp_client(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """examples/client.cpp, compiled."""
    client = tmp_path_factory.mktemp("cpp") / "client"
    done = run(program("c++"), *STRICT, EXAMPLES / "client.cpp", "-o", client)
    assert done.returncode == 0, done.stderr
    return client


def frames(printed: str) -> dict[str, list[float]]:
    """Return the numbers of each line of output, by its first word."""
    lines = [line.split() for line in printed.splitlines() if not line.startswith("refused")]
    return {line[0]: [float(word) for word in line[1:]] for line in lines}


def assert_there_and_back(done: subprocess.CompletedProcess[str], axes: int = 7) -> None:
    assert done.returncode == 0, done.stderr
    printed = frames(done.stdout)
    start = printed["start"]
    assert len(printed["joints"]) == axes
    assert printed["there"] == pytest.approx([start[0], start[1] + 50, *start[2:]], abs=1e-3)
    assert printed["back"] == pytest.approx(start, abs=1e-3)


@pytest.mark.slow
@pytest.mark.requirement("FRA005")
def test_the_client_in_cpp(cpp_client: Path) -> None:
    with Simulator(clock="fast") as simulator:
        assert_there_and_back(run(cpp_client, "127.0.0.1", str(simulator.port)))


@pytest.mark.slow
def test_the_tests_in_cpp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}:{os.environ['PATH']}")
    tests = tmp_path / "tests"
    done = run(program("c++"), *STRICT, "-I", EXAMPLES, EXAMPLES / "cpp" / "driver_tests.cpp", "-o", tests)
    assert done.returncode == 0, done.stderr
    for name in ("goes_there", "emergency_stop", "lost_reply"):
        assert run(tests, name).returncode == 0, name


@pytest.mark.requirement("FRA005")
def test_the_client_in_python() -> None:
    with Simulator(clock="fast") as simulator:
        done = run(sys.executable, EXAMPLES / "client.py", "127.0.0.1", str(simulator.port))
    assert_there_and_back(done)
    assert "refused: the TCP at " in done.stdout


def test_the_client_of_krc4_messages() -> None:
    with Simulator("kr_6_r900_sixx", protocol=["krc4"], clock="fast") as simulator:
        done = run(sys.executable, EXAMPLES / "client_krc4.py", "127.0.0.1", str(simulator.port))
    assert_there_and_back(done, axes=6)
    assert "refused: 3021" in done.stdout


@pytest.mark.slow
def test_a_drivers_project_has_the_fixture() -> None:
    alone = ("-W", "error", "-p", "no:asyncio", "-p", "no:cacheprovider")
    project = Path(__file__).parent / "examples" / "krc4_driver_project"
    done = ended([sys.executable, "-m", "pytest", *alone], cwd=project)
    assert "5 passed" in done.stdout, done.stdout + done.stderr
