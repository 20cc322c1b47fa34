"""The recipe for C++: configured, built and run by CMake and CTest, as its page says."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.needed import program

FOLDER = Path(__file__).parent.parent.parent / "examples" / "cpp"
STRICT = "-Wall -Wextra -Wpedantic -Werror"
BOUND_S = 300.0


def run(*words: str | Path, **environment: str) -> str:
    done = subprocess.run(
        words, env=os.environ | environment, capture_output=True, text=True, timeout=BOUND_S, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_ctest_starts_robots_and_passes(tmp_path: Path) -> None:
    cmake, ctest = program("cmake"), program("ctest")
    run(cmake, "-S", FOLDER, "-B", tmp_path, f"-DCMAKE_CXX_FLAGS={STRICT}")
    run(cmake, "--build", tmp_path)
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    said = run(ctest, "--test-dir", tmp_path, "--output-on-failure", PATH=path)
    assert "100% tests passed, 0 tests failed out of 3" in said


@pytest.mark.slow
def test_without_iiwa_sim_it_says_so(tmp_path: Path) -> None:
    client = tmp_path / "tests"
    run(program("c++"), "-std=c++17", f"-I{FOLDER.parent}", FOLDER / "driver_tests.cpp", "-o", client)
    done = subprocess.run(
        [client, "goes_there"], env={"PATH": ""}, capture_output=True, text=True, timeout=BOUND_S, check=False
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "goes_there: iiwa-sim did not start: it says why on stderr, if it is in PATH\n"
