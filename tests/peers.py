"""Programs and libraries that tests need and pip does not install. `.ci/nightly` installs them."""

from __future__ import annotations

import os
import shutil
from typing import NoReturn

import pytest


def program(name: str) -> str:
    """Return the path of a program; the test does not run without it."""
    path = shutil.which(name)
    if path is None:
        lacks(name)
    return path


def lacks(what: str) -> NoReturn:
    """Skip the test for want of something; with PEERS=required, as in `.ci/nightly`, fail it."""
    if os.environ.get("PEERS") == "required":
        pytest.fail(f"{what} is not there, which .ci/nightly installs")
    pytest.skip(f"{what} is not there")
