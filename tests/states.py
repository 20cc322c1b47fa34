"""Lines of the status port, checked against their schema."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

from jsonschema import Draft202012Validator

SCHEMA = json.loads(files("iiwa_sim.protocol").joinpath("status.schema.json").read_bytes())
Draft202012Validator.check_schema(SCHEMA)
_VALIDATOR = Draft202012Validator(SCHEMA)


def state(line: bytes) -> dict[str, Any]:
    """What a line says; it fits the schema."""
    assert line.endswith(b"\n")
    assert line.count(b"\n") == 1
    found: dict[str, Any] = json.loads(line)
    _VALIDATOR.validate(found)
    return found
