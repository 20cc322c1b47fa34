"""The tests that pages of docs/howto show, run as they stand there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

HOWTO = Path(__file__).parent.parent.parent / "docs" / "howto"
PAGES = sorted(HOWTO.glob("*.md"))
PYTHON = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


@pytest.mark.slow
def test_the_tests_of_the_pages_pass(pytester: pytest.Pytester) -> None:
    assert PAGES
    count = 0
    for page in PAGES:
        code = "\n\n".join(PYTHON.findall(page.read_text()))
        count += code.count("\ndef test_")
        pytester.path.joinpath(f"test_{page.stem.replace('-', '_')}.py").write_text(code)
    pytester.makeini("[pytest]\nasyncio_default_fixture_loop_scope = function\n")
    result = pytester.runpytest_subprocess("-W", "error", "-p", "no:cacheprovider", timeout=300)
    result.assert_outcomes(passed=count)
