"""Schemas and messages as others want them: Foxglove's published schemas, and Lichtblick's rules."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft7Validator

from iiwa_sim.cell.cell import load_cell
from iiwa_sim.recordings.schemas import BASE_TYPES, channels
from tests.recordings.recorded import FAR, PUBLISHED, Robot, found_in

ROOT = Path(__file__).parents[2]


def test_messages_with_foxgloves_names_fit_the_published_schemas(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    robot = Robot(path, load_cell(ROOT / "examples" / "table.toml"))
    robot.goes_to(*FAR)
    robot.step(50)
    robot.controller.stop()
    robot.until_stopped()
    robot.end()
    seen = set()
    for found in found_in(path):
        if found.schema_name.startswith("foxglove."):
            seen.add(found.schema_name)
            Draft7Validator(PUBLISHED[found.schema_name]).validate(found.content)
    names = ("FrameTransforms", "JointStates", "Log", "SceneUpdate")
    assert seen == {f"foxglove.{name}" for name in names}


def broken_rules(schema: dict[str, Any], place: str) -> Iterator[str]:
    """Of packages/mcap-support/src/parseJsonSchema.ts of Lichtblick-Suite/lichtblick, which skips a topic
    whose schema breaks one."""
    if "$ref" in schema:
        yield f"{place}: a $ref"
    elif "oneOf" in schema:
        if not all(isinstance(each.get("const"), int) for each in schema["oneOf"]):
            yield f"{place}: oneOf of others than numbers"
    elif schema.get("type") not in BASE_TYPES:
        yield f"{place}: type {schema.get('type')}"
    elif schema["type"] == "array":
        if schema["items"].get("type") == "array":
            yield f"{place}: an array of arrays"
        yield from broken_rules(schema["items"], f"{place}[]")
    for name, each in schema.get("properties", {}).items():
        yield from broken_rules(each, f"{place}.{name}")


@pytest.mark.parametrize("channel", channels(), ids=lambda channel: channel.topic)
def test_schemas_keep_the_rules_of_the_strictest_reader(channel: Any) -> None:
    assert channel.schema["type"] == "object"
    assert not list(broken_rules(channel.schema, channel.topic))
    Draft7Validator.check_schema(channel.schema)
