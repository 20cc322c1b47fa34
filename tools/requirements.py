"""Which tests show which requirement to hold, and whether they did when they last ran.

`make requirements` prints all requirements, with the commands that serve each, the tests that are marked with
it and how these last went; with `--run` it runs these tests first. `make lint` calls it with `--check`: it
prints only what is wrong. With `--page` it prints a page of the site, for `make docs`.

Exit code 1 if a requirement has no test, or one that failed or was skipped when it last ran. A test that has
not run yet is told and is no fault, since a fresh checkout is to pass `make lint`; with `--all-ran`, which
`.ci/run` says after the tests, it is one.
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

from iiwa_sim.dialect.krc4.table import load_krc4_table
from iiwa_sim.dialect.wire.table_file import load_table
from tests.last_results import FAILED, PASSED, SKIPPED, last_results

LIST = Path(__file__).parents[1] / "tests" / "requirements.toml"
NOT_YET = "not there yet"
NOT_RUN = "not run"
HEAD = """# Requirements

Every requirement on the controller, in our own words, the commands of the main port and the KRC4 messages
that serve it, and the files whose tests show it to hold. `make requirements` names these tests and says how
they went.

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
    """A pytest plugin that remembers the marked tests, and how they last went."""

    __test__ = False

    def __init__(self) -> None:
        self.of: dict[str, list[str]] = defaultdict(list)
        """Tests by the ids they are marked with, each test once for each of its parameters."""
        self.results: dict[str, str] = {}
        """Results of the tests that have run, by node id."""

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        for item in session.items:
            for requirement in ids_of(item):
                self.of[requirement].append(item.nodeid)

    def pytest_unconfigure(self, config: pytest.Config) -> None:
        """Results of this very run are written by then."""
        self.results = last_results(config)


def ids_of(item: pytest.Item) -> list[str]:
    """The requirements a test is marked with."""
    return [requirement for mark in item.iter_markers("requirement") for requirement in mark.args]


def unknown(ids: Iterable[str]) -> list[str]:
    """The ids that are no requirement."""
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


def failures(tests: dict[str, list[str]], results: dict[str, str]) -> list[str]:
    """Requirements that were not shown to hold when their tests last ran, one line for each test."""
    return [
        f"{requirement}: {test} {outcome} when it last ran; again: make test ARGS='{test}'"
        for requirement, names in tests.items()
        for test, outcome in _by_function(names, results).items()
        if outcome in (FAILED, SKIPPED)
    ]


def not_run(tests: dict[str, list[str]], results: dict[str, str]) -> list[str]:
    """What marked tests there are without any result, each without its parameters."""
    never = (_without_parameters(each) for names in tests.values() for each in names if each not in results)
    return sorted(set(never))


def page(tests: dict[str, list[str]]) -> str:
    """The page of the site, as if it lay in docs/."""
    rows = []
    for name, requirement in REQUIREMENTS.items():
        commands = ", ".join(f"`{each}`" for each in commands_of(name))
        files = dict.fromkeys(test.partition("::")[0] for test in tests.get(name, []))
        shown_by = [f"[{Path(each).stem}](../{each})" for each in files]
        shown_by += [requirement.met_by] if requirement.met_by else []
        rows.append(f"| {name} | {requirement.says} | {commands} | {', '.join(shown_by) or NOT_YET} |\n")
    return HEAD + "".join(rows)


def main() -> int:
    parser = argparse.ArgumentParser(prog="make requirements", description=__doc__.partition("\n")[0])
    parser.add_argument("--run", action="store_true", help="run the tests first")
    parser.add_argument("--check", action="store_true", help="only say what is wrong")
    parser.add_argument("--page", action="store_true", help="only print the page of the site")
    parser.add_argument("--all-ran", action="store_true", help="a test that has not run is a fault, too")
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

    if options.page:
        print(page(tests.of), end="")
        return 0
    if not options.check:
        _print(tests)
    faults = gaps(tests.of) + failures(tests.of, tests.results)
    if missing := not_run(tests.of, tests.results):
        many = f", nor have {len(missing) - 1} more" if missing[1:] else ""
        told_of = f"{missing[0]} shows a requirement and has not run here yet{many}: make test runs them"
        if options.all_ran:
            faults.append(told_of)
        else:
            print(told_of, file=sys.stderr)
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


def _print(tests: Tests) -> None:
    for name, requirement in REQUIREMENTS.items():
        print(f"{name}  {requirement.says}")
        if commands := commands_of(name):
            print(f"        commands: {', '.join(commands)}")
        for test, outcome in _by_function(tests.of.get(name, []), tests.results).items():
            print(f"        {outcome:7}  {test}")
        if requirement.met_by or not tests.of.get(name):
            print(f"        {requirement.met_by or NOT_YET}")


def _by_function(tests: Iterable[str], results: dict[str, str]) -> dict[str, str]:
    """The outcome of each test function: the worst of its parameters, or that one of them has not run."""
    outcomes: dict[str, set[str]] = defaultdict(set)
    for test in tests:
        outcomes[_without_parameters(test)].add(results.get(test, NOT_RUN))
    return {
        name: next(each for each in (FAILED, SKIPPED, NOT_RUN, PASSED) if each in found)
        for name, found in outcomes.items()
    }


def _without_parameters(test: str) -> str:
    return test.partition("[")[0]


if __name__ == "__main__":
    sys.exit(main())
