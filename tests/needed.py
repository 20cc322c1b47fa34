"""What tests need of the machine that pip does not bring. `.ci/run` installs it."""

from __future__ import annotations

import os
import shutil
from typing import NoReturn

import pytest


def program(name: str) -> str:
    """Where a program is; the test does not run without it."""
    path = shutil.which(name)
    if path is None:
        lacks(name)
    return path


def lacks(what: str) -> NoReturn:
    """Skip the test that asks, for want of something; with CI=true it fails, so that CI never shows less."""
    told = f"{what} is not there, which .ci/run installs"
    if os.environ.get("CI") == "true":
        pytest.fail(told)
    pytest.skip(told)
