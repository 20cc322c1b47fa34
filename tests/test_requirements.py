"""The list of requirements, and what is made of it."""

from __future__ import annotations

import re

import pytest

from iiwa_sim.dialect.table import load_table
from tests.requirements import REQUIREMENTS, commands_of, gaps, ids_of, page, unknown

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
