"""Commands of the pages that `make image` runs: which these are, and with what."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

IMAGE = Path(__file__).parent.parent.parent / ".ci" / "image"
OURS = {path.stem for path in IMAGE.glob("*.py")}


@pytest.fixture
def documented(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    monkeypatch.syspath_prepend(str(IMAGE))
    yield importlib.import_module("documented")
    for name in OURS & set(sys.modules):
        del sys.modules[name]


def test_all_of_them_are_run_with_their_options(documented: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    tried: dict[str, tuple[list[str], list[str]]] = {}
    monkeypatch.setattr(documented, "_answers", lambda _, what, *words: tried.update({what: words}))
    documented.try_documented(None)
    commands = {what: words for what, words in tried.items() if what.startswith("docker run")}
    assert commands == {
        "docker run --rm -p 30000:30000 iiwa-sim": ([], []),
        "docker run --rm -p 30000:30000 iiwa-sim --clock fast": ([], ["--clock", "fast"]),
        "docker run --rm -e IIWA_SIM_CLOCK=fast -p 30000:30000 iiwa-sim": (
            ["--env", "IIWA_SIM_CLOCK=fast"],
            [],
        ),
    }
    services = {what: words for what, words in tried.items() if what not in commands}
    assert set(services) == {"robot of compose.yaml", "robots of compose.yaml"}
    for options, behind in services.values():
        assert options[:3] == ["--read-only", "--cap-drop", "ALL"]
        assert "IIWA_SIM_ROBOT=" in options
        assert behind == []


def test_an_option_that_it_would_drop_is_a_fault(documented: Any) -> None:
    with pytest.raises(Exception, match="docker run --network: expected an option that"):
        documented._split(["--network", "host", "iiwa-sim"])
