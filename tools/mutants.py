"""Mutation testing: how many small changes to the core its tests notice: `make mutants ARGS="--room NAME"`.

mutmut makes mutants of the functions of a room in a copy of the project, the folder `mutants/`, by
`[tool.mutmut]` in pyproject.toml. A random sample of them is tested, each with those of the room's tests
that call its function. Survivors are printed as diffs.
"""

from __future__ import annotations

import argparse
import json
import random
import shutil
import sys
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from mutmut import __main__ as mutmut
from mutmut.configuration import config
from mutmut.mutation.diff_apply import get_diff_for_mutant
from mutmut.runners.harness import PytestRunner

ROOMS = {
    "controller": ["tests/controller"],
    "dialect": ["tests/dialect"],
    "motion/queue": ["tests/motion/queue", "tests/motion/test_blend.py", "tests/controller/test_mixes.py"],
}
"""Rooms of iiwa_sim, and the tests that their mutants have to fail."""
COPY = Path("mutants")
KILLED = ("killed", "timeout", "segfault")


def made() -> dict[str, int | None]:
    """The exit codes of the tests by the names of all mutants; None where they have not run."""
    codes: dict[str, int | None] = {}
    for meta in sorted(COPY.rglob("*.py.meta")):
        codes |= json.loads(meta.read_text())["exit_code_by_key"]
    return codes


def by_function(runner: PytestRunner, tests: Iterable[str]) -> list[str]:
    """Arguments for pytest: test functions instead of single parameters, some of which it cannot take."""
    functions = sorted({test.partition("[")[0] for test in tests})
    return ["-x", "-q", *(functions or runner._pytest_add_cli_args_test_selection)]


def main() -> int:
    parser = argparse.ArgumentParser(prog="make mutants", description=__doc__.partition("\n")[0])
    parser.add_argument("--room", choices=ROOMS, default="dialect", help="(default: %(default)s)")
    parser.add_argument("--count", type=int, default=100, help="size of the sample (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the sample (default: %(default)s)")
    parser.add_argument("--again", action="store_true", help="with the mutants of the run before")
    options = parser.parse_args()

    if not options.again:
        shutil.rmtree(COPY, ignore_errors=True)
    PytestRunner._pytest_args_regular_run = by_function
    settings = config()
    settings.only_mutate = [f"iiwa_sim/{options.room}/*"]
    settings.pytest_add_cli_args_test_selection = ROOMS[options.room]
    mutmut.copy_src_dir()
    mutmut.copy_also_copy_files()
    mutmut.create_mutants(2)
    every = sorted(made())
    sample = random.Random(options.seed).sample(every, min(options.count, len(every)))
    mutmut.run.callback(sample, max_children=2)
    results = {name: mutmut.status_by_exit_code[made()[name]] for name in sample}
    for name, result in results.items():
        if result not in KILLED:
            print(f"--- {name}: {result}\n{get_diff_for_mutant(name)}")
    counts = dict(Counter(results.values()))
    print(f"{options.room}: {len(every)} mutants, {len(sample)} of them tested: {counts}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
