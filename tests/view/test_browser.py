"""The page in a real browser, as somebody sees and uses it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tools import browser
from tools.shown_robot import started

NAMES = ("chromium", "chromium-browser", "google-chrome")


@pytest.mark.slow
def test_what_a_person_does_comes_to_pass(tmp_path: Path) -> None:
    """It is skipped, also in CI, for want of a browser that draws: that is not the page's fault."""
    playwright = pytest.importorskip("playwright.sync_api", reason="Playwright is not installed")
    path = next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        pytest.skip("no Chromium is installed, such as Debian's package chromium")
    with started() as robot, playwright.sync_playwright() as library:
        try:
            chromium = browser.launched(library, path)
            browser.walk(chromium, robot, tmp_path)
        except browser.Unusable as fault:
            pytest.skip(str(fault))
        chromium.close()
