"""docs/cells.md describes every key of a cell, and examples/every_key.toml uses it."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec

from iiwa_sim.cell import bodies
from iiwa_sim.cell import settings as cell_settings
from iiwa_sim.cell.settings import CellSettings

PAGE = (Path(__file__).parents[2] / "docs" / "cells.md").read_text()


def keys_of(kind: type[msgspec.Struct]) -> set[str]:
    """Return all keys of a table, and of the tables in it."""
    keys: set[str] = set()
    for field in msgspec.structs.fields(kind):
        keys.add(field.name)
        for inner in re.findall(r"\w+Settings", str(field.type)):
            keys |= keys_of((vars(cell_settings) | vars(bodies))[inner])
    return keys


def test_every_key_is_in_the_reference() -> None:
    tables = "\n".join(line for line in PAGE.splitlines() if line.startswith("|"))
    assert [key for key in keys_of(CellSettings) if not re.search(rf"`\[*{key}\]*`", tables)] == []
