"""What the image's build knows of libraries that an image does not have."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from pathlib import Path

import pytest

from tools.prune_libraries import LACKING

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
IN_IMAGES = {"cbor2", "cython", "h11", "msgspec", "numpy", "pinocchio", "ruckig", "websockets"}
"""Libraries of the dependencies, and of the extras that the Dockerfile names."""


def imported(text: str) -> set[str]:
    """Top-level names of what a module imports, anywhere in it."""
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            found.add((node.module or "").partition(".")[0])
    return found


@pytest.mark.slow
def test_each_library_that_a_module_imports_is_in_an_image_or_known_to_lack() -> None:
    texts = (path.read_text() for path in (ROOT / "iiwa_sim").rglob("*.py"))
    others = set[str]().union(*map(imported, texts)) - set(sys.stdlib_module_names) - {"iiwa_sim"}
    assert others - IN_IMAGES == LACKING


def test_an_image_has_the_extras_that_are_said_to_be_in_it() -> None:
    extras = [*PROJECT["optional-dependencies"]["rosbridge"], *PROJECT["optional-dependencies"]["http"]]
    assert {line.partition(">")[0] for line in extras} == {"cbor2", "h11", "websockets"}


def test_what_of_numpy_an_image_does_not_have_nothing_of_ours_asks_for() -> None:
    """Numpy loads its parts when they are named: `np.fft.fft` is no import that others would see."""
    gone = set(re.findall(r" numpy/(\w+)", (ROOT / "Dockerfile").read_text()))
    assert {"f2py", "ma", "polynomial"} <= gone
    asked = re.compile(rf"\b(?:np|numpy)\.(?:{'|'.join(sorted(gone))})\b")
    assert [path for path in (ROOT / "iiwa_sim").rglob("*.py") if asked.search(path.read_text())] == []
