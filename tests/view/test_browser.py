"""The page in a real browser, as somebody sees and uses it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tools import browser

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed, such as Debian's package chromium")
def test_what_a_person_does_comes_to_pass(tmp_path: Path) -> None:
    playwright = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    with browser.started() as robot, playwright.sync_playwright() as library:
        chromium = library.chromium.launch(executable_path=CHROMIUM, args=[*browser.ARGUMENTS])
        browser.walk(chromium, robot, tmp_path)
        chromium.close()
