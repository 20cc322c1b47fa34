"""Lines of the status port, checked against their schema."""

from __future__ import annotations

import json
import socket
from importlib.resources import files
from typing import Any

from jsonschema import Draft202012Validator

from iiwa_sim.simulator import Simulator
from tests.line_client import DEADLINE_S, wait_until

SCHEMA = json.loads(files("iiwa_sim.protocol").joinpath("status.schema.json").read_bytes())
Draft202012Validator.check_schema(SCHEMA)
_VALIDATOR = Draft202012Validator(SCHEMA)


def state(line: bytes) -> dict[str, Any]:
    """Return the state in a line, checked against the schema."""
    assert line.endswith(b"\n")
    assert line.count(b"\n") == 1
    found: dict[str, Any] = json.loads(line)
    _VALIDATOR.validate(found)
    return found


def on_the_status_port(simulator: Simulator) -> dict[str, Any]:
    """Return the state that a stepped simulator sends there after 0.1 s."""
    assert simulator.status_port is not None
    with socket.create_connection((simulator.host, simulator.status_port), DEADLINE_S) as reader:
        wait_until(lambda: simulator.call(lambda: bool(simulator._status and simulator._status.connections)))
        simulator.advance(0.1)
        return state(reader.makefile("rb").readline())
