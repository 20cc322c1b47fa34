"""The list of requirements, and what is made of it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from iiwa_sim.dialect.wire.table_file import load_table
from tests.last_results import last_results
from tools.requirements import REQUIREMENTS, commands_of, failures, gaps, ids_of, not_run, page, unknown

TESTS = {name: [f"tests/test_{name}.py::test"] for name, each in REQUIREMENTS.items() if not each.later}


def test_no_test_that_runs_now_is_marked_with_an_id_that_is_none(request: pytest.FixtureRequest) -> None:
    assert unknown(each for item in request.session.items for each in ids_of(item)) == []


def test_no_command_has_an_id_that_is_none() -> None:
    assert (
        unknown(each for command in load_table("iiwa").commands.values() for each in command.requirements)
        == []
    )


def test_the_list_is_the_texts() -> None:
    numbers = {"FRA": [*range(1, 8), *range(101, 105), 201, 202], "FRC": range(1, 27), "FRO": [1]}
    assert list(REQUIREMENTS) == [f"{kind}{number:03}" for kind, each in numbers.items() for number in each]
    assert all(re.fullmatch(r"[^|\n]+", each.says) for each in REQUIREMENTS.values())
    assert not any(each.later and each.met_by for each in REQUIREMENTS.values())


def test_a_requirement_without_a_test_is_found() -> None:
    assert gaps(TESTS) == []
    assert gaps({**TESTS, "FRC003": []}) == ["FRC003 has no test: a stop, fast"]
    assert gaps({**TESTS, "FRA001": []}) == [], "no test can show it"


def test_an_id_that_is_none_is_found() -> None:
    (told,) = gaps({**TESTS, "FRC999": ["tests/test_x.py::test"]})
    assert told.startswith("FRC999 is no requirement")


def test_what_was_to_come_later_and_is_there_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(REQUIREMENTS["FRC003"], "later", True)
    assert gaps(TESTS) == ["FRC003 has tests now: take its `later` out of requirements.toml"]


def test_the_page_has_a_row_for_each_with_its_commands_and_files() -> None:
    rows = [line for line in page(TESTS).splitlines() if line.startswith("| FR")]
    assert len(rows) == len(REQUIREMENTS)
    assert "| FRC003 | a stop, fast | `bye`, `stop`, `STO` | [test_FRC003](../tests/test_FRC003.py) |" in rows
    assert commands_of("FRC018") == ["get flange frame"]


RAN = {test: "passed" for tests in TESTS.values() for test in tests}


def test_a_requirement_whose_test_failed_or_was_skipped_is_found() -> None:
    assert failures(TESTS, RAN) == []
    (test,) = TESTS["FRC003"]
    for outcome in ("failed", "skipped"):
        (told,) = failures(TESTS, {**RAN, test: outcome})
        assert told == f"FRC003: {test} {outcome} when it last ran; again: make test ARGS='{test}'"


def test_one_parameter_of_many_that_failed_is_found() -> None:
    test = "tests/test_x.py::test"
    both = {"FRC003": [f"{test}[a]", f"{test}[b]"]}
    (told,) = failures(both, {f"{test}[a]": "failed", f"{test}[b]": "passed"})
    assert told.startswith(f"FRC003: {test} failed")


def test_a_test_that_has_not_run_is_told_apart_from_one_that_failed() -> None:
    assert not_run(TESTS, RAN) == []
    assert failures(TESTS, {}) == []
    assert not_run({"FRC003": ["tests/test_x.py::test[a]", "tests/test_x.py::test[b]"]}, {}) == [
        "tests/test_x.py::test"
    ]


OUTCOMES = """
import pytest

pytestmark = pytest.mark.requirement("FRC003")

def test_good(): pass
def test_bad(): assert {bad}
def test_left_out(): pytest.skip("not here")
def test_torn_down_badly(request): request.addfinalizer(lambda: 1 / 0)
"""
NO_MARK = "def test_without_a_mark(): assert False"
CONFTEST = """
from tests import last_results

def pytest_configure(config):
    config.addinivalue_line("markers", "requirement(*ids)")
    last_results.register(config)
"""


@pytest.mark.slow
@pytest.mark.parametrize("spread", [[], ["-p", "xdist", "-n", "1"]], ids=["one process", "xdist"])
def test_a_run_is_remembered_until_the_test_runs_again(
    pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch, spread: list[str]
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent.parent))
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    pytester.makeconftest(CONFTEST)
    (pytester.path / "test_outcomes.py").write_text(OUTCOMES.format(bad=False))
    (pytester.path / "test_without.py").write_text(NO_MARK)
    pytester.runpytest_subprocess(*spread)
    assert _remembered(pytester) == {
        "test_outcomes.py::test_good": "passed",
        "test_outcomes.py::test_bad": "failed",
        "test_outcomes.py::test_left_out": "skipped",
        "test_outcomes.py::test_torn_down_badly": "failed",
    }

    (pytester.path / "test_outcomes.py").write_text(OUTCOMES.format(bad=True))
    pytester.runpytest_subprocess(*spread, "-k", "test_bad")
    assert _remembered(pytester)["test_outcomes.py::test_bad"] == "passed"
    assert _remembered(pytester)["test_outcomes.py::test_torn_down_badly"] == "failed", "it has not run again"


def _remembered(pytester: pytest.Pytester) -> dict[str, str]:
    return last_results(pytester.parseconfigure())
