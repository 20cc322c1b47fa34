"""Which tests show which requirement to hold: `python -m tests.requirements`.

Prints a table of all requirements, with the commands that serve each and the tests that are marked with it,
and writes `docs/requirements.md`. `--run` also runs these tests and tells the results. `--check` prints only
what is wrong and writes nothing. Exit code 1 if a requirement has no test, or one that fails.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import sys
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

import msgspec
import pytest

from iiwa_sim.dialect.krc4_table import load_krc4_table
from iiwa_sim.dialect.table import load_table

LIST = Path(__file__).with_name("requirements.toml")
PAGE = Path(__file__).parent.parent / "docs" / "requirements.md"
NOT_YET = "not there yet"
HEAD = """# Requirements

Every requirement on the controller, in our own words, the commands of the main port and the KRC4 messages
that serve it, and the files whose tests show it to hold. Written by `make requirements`, which also runs
these tests and names them.

| | requirement | commands | shown by |
|---|---|---|---|
"""


class Requirement(msgspec.Struct, forbid_unknown_fields=True):
    """One row of the list."""

    says: str
    met_by: str = ""
    """What meets it, where no test can show it as a whole."""
    later: bool = False
    """Not built yet."""


REQUIREMENTS = msgspec.toml.decode(LIST.read_bytes(), type=dict[str, Requirement])


class Tests:
    """A pytest plugin that remembers the marked tests, and how they went if they are run."""

    __test__ = False

    def __init__(self) -> None:
        self.of: dict[str, list[str]] = defaultdict(list)
        """Tests by the ids they are marked with, each test once whatever its parameters."""
        self.failed: set[str] = set()
        self.passed: set[str] = set()

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        for item in session.items:
            name = _without_parameters(item.nodeid)
            for requirement in ids_of(item):
                if name not in self.of[requirement]:
                    self.of[requirement].append(name)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        name = _without_parameters(report.nodeid)
        if report.failed:
            self.failed.add(name)
        elif report.passed and report.when == "call":
            self.passed.add(name)

    def result(self, test: str) -> str:
        """Of a test that was to be run."""
        if test in self.failed:
            return "failed"
        return "passed" if test in self.passed else "skipped"


def ids_of(item: pytest.Item) -> list[str]:
    """The requirements a test is marked with."""
    return [requirement for mark in item.iter_markers("requirement") for requirement in mark.args]


def unknown(ids: Iterable[str]) -> list[str]:
    """Those that are none."""
    return sorted(set(ids) - set(REQUIREMENTS))


def commands_of(requirement: str) -> list[str]:
    """The commands that are there and serve it, of the main port and of KRC4 messages."""
    commands = load_table("iiwa").commands
    messages = load_krc4_table().commands.values()
    return [
        *(name for name, each in commands.items() if requirement in each.requirements),
        *(each.tag for each in messages if requirement in each.requirements),
    ]


def gaps(tests: dict[str, list[str]]) -> list[str]:
    """What is wrong with the list, given the tests of each requirement."""
    found = [
        f"{each} is no requirement of {LIST.name}, and yet a test is marked with it"
        for each in unknown(tests)
    ]
    for name, requirement in REQUIREMENTS.items():
        if tests.get(name) and requirement.later:
            found.append(f"{name} has tests now: take its `later` out of {LIST.name}")
        elif not (tests.get(name) or requirement.later or requirement.met_by):
            found.append(f"{name} has no test: {requirement.says}")
    return found


def page(tests: dict[str, list[str]]) -> str:
    """docs/requirements.md"""
    rows = []
    for name, requirement in REQUIREMENTS.items():
        commands = ", ".join(f"`{each}`" for each in commands_of(name))
        files = dict.fromkeys(test.partition("::")[0] for test in tests.get(name, []))
        shown_by = [f"[{Path(each).stem}](../{each})" for each in files]
        shown_by += [requirement.met_by] if requirement.met_by else []
        rows.append(f"| {name} | {requirement.says} | {commands} | {', '.join(shown_by) or NOT_YET} |\n")
    return HEAD + "".join(rows)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.requirements", description=__doc__)
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--run", action="store_true", help="run the tests, too")
    what.add_argument("--check", action="store_true", help="only say what is wrong")
    options = parser.parse_args()

    tests = Tests()
    if options.run:
        code = pytest.main(["-m", "requirement"], plugins=[tests])
    else:
        with contextlib.redirect_stdout(io.StringIO()) as told:
            code = pytest.main(["--collect-only", "-q"], plugins=[tests])
        if code != pytest.ExitCode.OK:
            print(told.getvalue())
    if code not in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED):
        return int(code)
    faults = gaps(tests.of)
    faults += [f"{test} failed" for test in sorted(tests.failed)]
    if options.check:
        if not PAGE.is_file() or PAGE.read_text() != page(tests.of):
            faults.append(f"docs/{PAGE.name} is out of date: python -m tests.requirements writes it")
    else:
        PAGE.write_text(page(tests.of))
        _print(tests, options.run)
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


def _print(tests: Tests, with_results: bool) -> None:
    for name, requirement in REQUIREMENTS.items():
        print(f"{name}  {requirement.says}")
        if commands := commands_of(name):
            print(f"        commands: {', '.join(commands)}")
        for test in tests.of.get(name, []):
            print(f"        {tests.result(test) + '  ' if with_results else ''}{test}")
        if requirement.met_by or not tests.of.get(name):
            print(f"        {requirement.met_by or NOT_YET}")


def _without_parameters(test: str) -> str:
    return test.partition("[")[0]


if __name__ == "__main__":
    sys.exit(main())
