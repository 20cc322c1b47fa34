"""Check that each requirement of tests/requirements.toml has a marked test; print those that have none."""

from __future__ import annotations

import contextlib
import io
import sys
from collections import defaultdict
from pathlib import Path

import msgspec
import pytest

LIST = Path(__file__).parents[1] / "tests" / "requirements.toml"


class Requirement(msgspec.Struct, forbid_unknown_fields=True):
    """One entry of the list; `met_by` names what meets it where no test can."""

    says: str
    met_by: str = ""
    later: bool = False


class Marked:
    """Pytest plugin that collects the tests marked with each requirement."""

    def __init__(self) -> None:
        self.tests: dict[str, list[str]] = defaultdict(list)

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        for item in session.items:
            for mark in item.iter_markers("requirement"):
                for name in mark.args:
                    self.tests[name].append(item.nodeid)


def main() -> int:
    marked = Marked()
    with contextlib.redirect_stdout(io.StringIO()) as output:
        code = pytest.main(["--collect-only", "-q"], plugins=[marked])
    if code != pytest.ExitCode.OK:
        print(output.getvalue())
        return int(code)
    known = msgspec.toml.decode(LIST.read_bytes(), type=dict[str, Requirement])
    gaps = [
        f"{name}: a test is marked with it, {LIST.name} lacks it"
        for name in marked.tests
        if name not in known
    ]
    for name, requirement in known.items():
        if requirement.later and name in marked.tests:
            gaps.append(f"{name} has tests: remove its `later` from {LIST.name}")
        elif not (requirement.later or requirement.met_by or name in marked.tests):
            gaps.append(f"{name} has no test: {requirement.says}")
    print(*gaps, sep="\n", file=sys.stderr, end="\n" if gaps else "")
    return 1 if gaps else 0


if __name__ == "__main__":
    sys.exit(main())
