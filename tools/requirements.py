"""Check that each requirement of tests/requirements.toml has a marked test; print those that have none."""

import contextlib
import io
import sys
import tomllib
from pathlib import Path

import pytest

LIST = Path(__file__).parents[1] / "tests" / "requirements.toml"


class Marked:
    """Pytest plugin that collects the requirements that tests are marked with."""

    def __init__(self) -> None:
        self.names: set[str] = set()

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        for item in session.items:
            self.names.update(*(mark.args for mark in item.iter_markers("requirement")))


def main() -> int:
    marked = Marked()
    with contextlib.redirect_stdout(io.StringIO()) as output:
        code = pytest.main(["--collect-only", "-q"], plugins=[marked])
    if code != pytest.ExitCode.OK:
        print(output.getvalue())
        return int(code)
    listed = tomllib.loads(LIST.read_text("utf-8"))
    gaps = [f"{name}: a test is marked with it, {LIST.name} lacks it" for name in marked.names - set(listed)]
    for name, entry in listed.items():
        if entry.get("later") and name in marked.names:
            gaps.append(f"{name} has tests: remove its `later` from {LIST.name}")
        elif not (entry.get("later") or entry.get("met_by") or name in marked.names):
            gaps.append(f"{name} has no test: {entry['says']}")
    print(*sorted(gaps), sep="\n", file=sys.stderr, end="\n" if gaps else "")
    return 1 if gaps else 0


if __name__ == "__main__":
    sys.exit(main())
