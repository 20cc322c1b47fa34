"""A fact stands in one place: the parser tells the defaults of options, and the site has them from there."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest

from iiwa_sim.cli.server_options import server_parser
from iiwa_sim.pytest_options import DEFAULT_CLOCK
from iiwa_sim.robot.description import DEFAULT_ROBOT
from iiwa_sim.simulator import Simulator

ROOT = Path(__file__).parent.parent.parent
PAGES = [ROOT / "README.md", ROOT / "SECURITY.md", *sorted((ROOT / "docs").rglob("*.md"))]
PASSAGE = re.compile(r"\n\s*\n|\n(?=[-|] )")
OPTIONS = [spelling for action in server_parser().options for spelling in action.option_strings]
TABLE_ROW = re.compile(r"^\| `(\w+)` \| `--iiwa[^|]*\|[^|]*\| `?([^`|]*?)`? \|", re.MULTILINE)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_no_page_tells_the_default_of_an_option(page: Path) -> None:
    told = [
        passage
        for passage in PASSAGE.split(page.read_text())
        if re.search(r"\bdefaults? |\bdefault\b", passage)
        and any(re.search(rf"{option}(?![\w-])", passage) for option in OPTIONS if option.startswith("--"))
    ]
    assert told == []


def test_defaults_of_the_fixture_are_those_of_the_simulator_but_the_clock() -> None:
    told = dict(TABLE_ROW.findall((ROOT / "docs" / "testing.md").read_text()))
    parameters = inspect.signature(Simulator).parameters
    assert told == {
        "robot": DEFAULT_ROBOT,
        "cell": "none",
        "dialects": " ".join(parameters["dialects"].default),
        "clock": DEFAULT_CLOCK,
        "rate_hz": str(parameters["rate_hz"].default),
        "strict": str(parameters["strict"].default),
    }


def test_every_option_tells_its_default_or_needs_none() -> None:
    missing = [
        action.option_strings[0]
        for action in server_parser().options
        if action.option_strings and action.nargs != 0 and "(default: " not in (action.help or "")
    ]
    assert set(missing) <= WITHOUT


WITHOUT = {"--backdoor-token-file", "--view-token-file", "--transcript", "--record"}
"""What is not there unless it is named."""
