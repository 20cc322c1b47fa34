"""compose.yaml, as Compose itself understands it; it is not started here, where there is no Docker."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from iiwa_sim.cli import server_options
from iiwa_sim.cli.environment import unknown_variables

ROOT = Path(__file__).parent.parent.parent
FILE = ROOT / "compose.yaml"
BIN = Path(sys.executable).parent


def understood(file: Path, *options: str, **environment: str) -> dict[str, Any]:
    words = [str(BIN / "docker-compose"), "--file", str(file), *options, "config", "--format", "json"]
    done = subprocess.run(
        words, capture_output=True, text=True, check=False, timeout=60, env=os.environ | environment
    )
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout))


def test_one_robot_or_five_more() -> None:
    assert set(understood(FILE)["services"]) == {"robot"}
    services = understood(FILE, "--profile", "five")["services"]
    assert set(services) == {"robot", "robots"}
    assert services["robots"]["deploy"]["replicas"] == 5
    (one,), (range_,) = services["robot"]["ports"], services["robots"]["ports"]
    assert (one["published"], one["target"], one["host_ip"]) == ("30000", 30000, "127.0.0.1")
    assert (range_["published"], range_["target"]) == ("30010-30029", 30000)
    for service in services.values():
        assert service["read_only"]
        assert service["cap_drop"] == ["ALL"]


def test_variables_are_options_and_are_handed_on() -> None:
    wanted = {"IIWA_SIM_CLOCK": "fast", "IIWA_SIM_ROBOT": "lbr_iiwa_14_r820"}
    for given in ({}, wanted):
        environment = understood(FILE, **given)["services"]["robot"]["environment"]
        assert unknown_variables(server_options.server_parser(), environment) == []
        options = server_options.parsed([], environment)
        assert options.clock.name == given.get("IIWA_SIM_CLOCK", "real")
        assert options.robot == given.get("IIWA_SIM_ROBOT")


def test_a_key_that_is_none_would_be_seen(tmp_path: Path) -> None:
    file = tmp_path / "compose.yaml"
    file.write_text(FILE.read_text().replace("read_only:", "readonly:"))
    with pytest.raises(AssertionError, match="readonly"):
        understood(file)
