"""What pages name in backticks is there: files, modules, classes, functions, options, subcommands, ..."""

from __future__ import annotations

import builtins
import re
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest

from iiwa_sim import pytest_options

ROOT = Path(__file__).parent.parent
PAGES = sorted(page for pages in (ROOT.glob("*.md"), (ROOT / "docs").rglob("*.md")) for page in pages)
ROOMS = [ROOT / room for room in ("", "iiwa_sim", "iiwa_sim/dialect", "iiwa_sim/ros", "docs")]
"""Folders from which a page may name a path."""
MADE = {".git", ".venv", ".hypothesis", "build", "dist", "mutants"}
NAMED = re.compile(r"`([^`\n]+)`")
PATH = re.compile(r"[\w.*-]+(/[\w.*-]+)*/?")
ENDINGS = (
    ".py", ".pxd", ".toml", ".md", ".json", ".urdf", ".svg", ".hpp", ".cpp", ".mjs", ".yaml", ".yml", "/",
)  # fmt: skip
MODULE = re.compile(r"(?:iiwa_sim\.)?([a-z_]+(?:\.[a-z_0-9]+)*)\.([A-Z]\w*)")
NAME = re.compile(
    r"(?<![\w-])--[a-z][a-z-]+|[A-Za-z_]+_\w+|_\w+|[A-Z][a-z]+[A-Z]\w+|\w+(?=\()|(?<=[a-z]\.)[a-z]\w+"
)
"""What can only be a name of the code: an option, snake_case, CamelCase, a call, an attribute."""
RUN = re.compile(r"(make|python -m|iiwa-sim) ([a-z][\w.-]*)")
OF_OTHERS = {"urls"}  # a key of pyproject.toml, which is told not to be there


def named(page: Path) -> list[str]:
    """What a page has in backticks, outside of blocks of code."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    return NAMED.findall(text)


@cache
def files() -> tuple[Path, ...]:
    """The files of the project, without those that a build or a test run makes."""
    tops = [path for path in ROOT.iterdir() if path.name not in MADE and not path.name.endswith("_cache")]
    found = [path for top in tops for path in (top.rglob("*") if top.is_dir() else [top])]
    return tuple(path for path in found if path.is_file() and "__pycache__" not in path.parts)


@cache
def names() -> frozenset[str]:
    """All names in the code, the tables, the tests but this one, and Python."""
    kinds = {".py", ".pxd", ".toml", ".json", ".yaml", ".yml", ".msg", ".srv", ".action", ".mjs", ""}
    texts = [path for path in files() if path.suffix in kinds and path != Path(__file__)]
    words = re.compile(r"(?<![\w-])--[a-z][a-z-]+|\w+")
    found = {word for path in texts for word in words.findall(path.read_text("utf-8", "replace"))}
    found |= {f"{start}{name}" for name in pytest_options.INI for start in ("--iiwa-", "iiwa_")}
    found |= {*OF_OTHERS, *dir(builtins)}
    return frozenset(found.union(path.stem for path in texts))


def is_a_path(word: str) -> bool:
    top, slash, _ = word.partition("/")
    return word.endswith(ENDINGS) or bool(slash and (ROOT / top).exists())


def is_there(path: str) -> bool:
    if f"/{path}" in (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines():
        return True  # it is made when it is wanted
    if any(list(room.glob(path)) for room in ROOMS):
        return True
    return "/" not in path and any(file.match(path) for file in files())


def is_a_name(module: str, name: str) -> bool:
    try:
        return hasattr(import_module(f"iiwa_sim.{module}"), name)
    except ModuleNotFoundError:
        return False


def is_run(program: str, what: str) -> bool:
    """Whether there is such a target, module or subcommand."""
    if program == "make":
        (targets,) = re.findall(r"^\.PHONY: (.*)$", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
        return what in targets.split()
    path = what.replace(".", "/") if program == "python -m" else f"iiwa_sim/cli/{what.replace('-', '_')}"
    return any((ROOT / f"{path}{end}").is_file() for end in (".py", "/__main__.py"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_what_a_page_names_is_there(page: Path) -> None:
    missing = []
    for word in named(page):
        if PATH.fullmatch(word) and word not in ENDINGS and is_a_path(word):
            there = is_there(word)
        elif match := MODULE.fullmatch(word):
            there = is_a_name(*match.groups())
        else:
            there = names().issuperset(NAME.findall(word)) and all(is_run(*run) for run in RUN.findall(word))
        if not there:
            missing.append(word)
    assert not missing


def test_the_makefile_says_which_of_its_targets_take_options() -> None:
    text = (ROOT / "Makefile").read_text("utf-8")
    (said,) = re.findall(r'^# make (.*), each with ARGS="\.\.\."', text)
    rules = re.findall(r"^([a-z-]+):.*\n((?:\t.*\n)+)", text, re.MULTILINE)
    assert said.split(" | ") == [target for target, recipe in rules if "$(ARGS)" in recipe]
