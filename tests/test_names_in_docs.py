"""What CONTRIBUTING.md and docs/ name in backticks is there: files, folders, modules, classes."""

from __future__ import annotations

import builtins
import re
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
PACKAGE = ROOT / "iiwa_sim"
ROOMS = [ROOT, PACKAGE, PACKAGE / "dialect", PACKAGE / "ros", ROOT / "docs"]
"""Folders from which a page may name a path."""
NAMED = re.compile(r"`([^`\n]+)`")
PATH = re.compile(r"\.?[\w.-]+(/[\w.-]+)*/?")
ENDINGS = (".py", ".toml", ".md", ".json", ".urdf", ".svg", ".hpp", ".cpp", ".mjs", ".yaml")
MODULE = re.compile(r"(?:iiwa_sim\.)?([a-z_]+(?:\.[a-z_0-9]+)*)\.([A-Z]\w*)")
CLASS = re.compile(r"[A-Z][a-z]+(?:[A-Z][a-z]+)+")
DEFINED = re.compile(r"^\s*class (\w+)|^(\w+) = ", re.MULTILINE)
OF_OTHERS = {
    "CommandList", "EulerFrame", "GetDigitalIOs", "JointState", "RobotStatus", "SetDigitalIOs", "SetFloat",
}  # fmt: skip
"""Types of ROS, which are files of protocol/rmi."""


def named(page: Path) -> list[str]:
    """What a page has in backticks, outside of blocks of code."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    return NAMED.findall(text)


@cache
def defined() -> set[str]:
    """The classes and module-level names of the project."""
    files = [path for room in ("iiwa_sim", "tests", "tools") for path in (ROOT / room).rglob("*.py")]
    return {a or b for path in files for a, b in DEFINED.findall(path.read_text(encoding="utf-8"))}


def is_there(path: str) -> bool:
    if f"/{path}" in (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines():
        return True  # it is made when it is wanted
    return any((room / path).exists() for room in ROOMS) or (
        "/" not in path and any(ROOT.glob(f"*/**/{path}"))
    )


def is_a_name(module: str, name: str) -> bool:
    try:
        return hasattr(import_module(f"iiwa_sim.{module}"), name)
    except ModuleNotFoundError:
        return False


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_what_a_page_names_is_there(page: Path) -> None:
    missing = []
    for word in named(page):
        if PATH.fullmatch(word) and (word.endswith((*ENDINGS, "/"))):
            there = is_there(word)
        elif match := MODULE.fullmatch(word):
            there = is_a_name(*match.groups())
        elif CLASS.fullmatch(word):
            there = word in defined() | OF_OTHERS or hasattr(builtins, word)
        else:
            continue
        if not there:
            missing.append(word)
    assert not missing
