"""`--iiwa-artifacts`: recordings of the robots of failed tests, in the projects of users."""

from __future__ import annotations

import textwrap

import pytest

import iiwa_sim.recordings.recorder
import iiwa_sim.simulator  # noqa: F401  # pytest within this process then drops no part of them at its end
from tests.recordings.recorded import contents

TESTS = """
import socket
import pytest

def ask(iiwa, line):
    with socket.create_connection((iiwa.host, iiwa.port), timeout=60) as connection:
        connection.sendall(line.encode() + b"\\r\\n")
        return connection.makefile().readline().strip()

def test_passes(iiwa):
    assert ask(iiwa, "hello") == "hello"

@pytest.mark.parametrize("word", ["hello", "a/b c"])
def test_fails(iiwa, word):
    assert ask(iiwa, "get status") == word

def test_without_a_robot():
    assert False

@pytest.fixture
def breaks(iiwa):
    yield
    assert ask(iiwa, "get status") == "moving"

def test_fails_at_its_end(breaks):
    pass
"""


@pytest.fixture
def project(pytester: pytest.Pytester) -> pytest.Pytester:
    pytester.makeini("[pytest]\nasyncio_default_fixture_loop_scope = function\n")
    return pytester


def run(project: pytest.Pytester, code: str, *options: str) -> pytest.RunResult:
    project.makepyfile(textwrap.dedent(code))
    return project.runpytest_inprocess("-W", "error", "-p", "no:cacheprovider", *options)


def test_recordings_of_failed_tests_are_kept_and_named(project: pytest.Pytester) -> None:
    result = run(project, TESTS, "--iiwa-artifacts", "kept/here")
    result.assert_outcomes(passed=2, failed=3, errors=1)
    folder = project.path / "kept" / "here"
    kept = sorted(folder.iterdir())
    assert len(kept) == 3
    report = result.stdout.str()
    assert report.count("- iiwa recording -") == 3
    for path in kept:
        assert path.name.startswith("test_recordings_of_failed_tests_are_kept_and_named.py_test_fails")
        assert f"\n{path}\nto look at it: iiwa-sim show {path}" in report
        texts = [each["text"] for each in contents(path, "/dialogue")]
        assert texts == ["connected", "get status", "stopped", "disconnected"]
        assert contents(path, "/state")[-1]["status"] == "stopped"
