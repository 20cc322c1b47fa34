"""Schemas keep the rules of Lichtblick."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from jsonschema import Draft7Validator

from iiwa_sim.recordings.schemas import CHANNELS, schemas
from tests.cell.cells import EXAMPLES

TYPES = ("object", "array", "string", "number", "integer", "boolean")


def broken_rules(schema: dict[str, Any], place: str) -> Iterator[str]:
    """Return the broken rules of parseJsonSchema.ts of Lichtblick, which skips a topic with one."""
    if "$ref" in schema:
        yield f"{place}: a $ref"
    elif "oneOf" in schema:
        if not all(isinstance(each.get("const"), int) for each in schema["oneOf"]):
            yield f"{place}: oneOf of others than numbers"
    elif schema.get("type") not in TYPES:
        yield f"{place}: type {schema.get('type')}"
    elif schema["type"] == "array":
        if schema["items"].get("type") == "array":
            yield f"{place}: an array of arrays"
        yield from broken_rules(schema["items"], f"{place}[]")
    for name, each in schema.get("properties", {}).items():
        yield from broken_rules(each, f"{place}.{name}")


@pytest.mark.parametrize(("name", "schema"), schemas().items(), ids=schemas())
def test_schemas_keep_the_rules_of_the_strictest_reader(name: str, schema: dict[str, Any]) -> None:
    assert schema["type"] == "object"
    assert not list(broken_rules(schema, name))
    Draft7Validator.check_schema(schema)


def test_the_layout_shows_all_scenes() -> None:
    """Foxglove and Lichtblick hide a topic of scenes unless the layout has it."""
    layout = json.loads((EXAMPLES / "foxglove_layout.json").read_text("utf-8"))
    shown = {topic for topic, each in layout["configById"]["3D!arm"]["topics"].items() if each["visible"]}
    assert shown == {topic for topic, schema in CHANNELS.items() if schema == "foxglove.SceneUpdate"}
