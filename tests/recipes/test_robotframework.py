"""The suite of Robot Framework, run by it."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.processes import succeeds

FOLDER = Path(__file__).parent.parent.parent / "examples" / "robotframework"
BIN = Path(sys.executable).parent


def test_the_suite_passes(tmp_path: Path) -> None:
    words = [str(BIN / "robot"), "--outputdir", str(tmp_path), str(FOLDER / "driver.robot")]
    assert "3 tests, 3 passed, 0 failed" in succeeds(words)


def test_each_keyword_is_documented() -> None:
    words = [str(BIN / "libdoc"), "--pythonpath", str(FOLDER), "IiwaSim", "show"]
    said = succeeds(words)
    for name in ("Robot Address", "Lin Move", "Press Emergency Stop", "Tool Should Be At"):
        assert name in said
