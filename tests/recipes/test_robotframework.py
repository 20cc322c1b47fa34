"""The suite of Robot Framework, run by it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from tests.talking import DEADLINE_S

FOLDER = Path(__file__).parent.parent.parent / "examples" / "robotframework"
BIN = Path(sys.executable).parent


def test_the_suite_passes(tmp_path: Path) -> None:
    words = [str(BIN / "robot"), "--outputdir", str(tmp_path), str(FOLDER / "driver.robot")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=DEADLINE_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 tests, 3 passed, 0 failed" in done.stdout


def test_each_keyword_is_documented() -> None:
    words = [str(BIN / "libdoc"), "--pythonpath", str(FOLDER), "IiwaSim", "show"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=DEADLINE_S, check=False)
    assert done.returncode == 0, done.stderr
    for name in ("Robot Address", "Lin Move", "Press Emergency Stop", "Tool Should Be At"):
        assert name in done.stdout
