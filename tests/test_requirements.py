"""The list of requirements, and what is made of it."""

from __future__ import annotations

import re

import pytest

from iiwa_sim.dialect.wire.table_file import load_table
from tools.requirements import REQUIREMENTS, failures, gaps, ids_of, unknown

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


RAN = {test: "passed" for tests in TESTS.values() for test in tests}


def test_a_requirement_whose_test_failed_or_was_skipped_is_found() -> None:
    assert failures(TESTS, RAN) == []
    (test,) = TESTS["FRC003"]
    for outcome in ("failed", "skipped"):
        (told,) = failures(TESTS, {**RAN, test: outcome})
        assert told == f"FRC003: {test} {outcome} when it last ran; again: make test ARGS='{test}'"
