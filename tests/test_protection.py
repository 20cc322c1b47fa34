"""A robot that protects itself, as a driver and the status port see it."""

from __future__ import annotations

import re

import pytest

from iiwa_sim import Iiwa, Simulator
from iiwa_sim.controller.errors import ErrorRecord
from tests.cell.cells import EXAMPLES
from tests.states import on_the_status_port

CAUSE = r"protective stop: collision: the external force at the TCP is [\d.]+ N, its threshold is 80 N"


def test_a_protective_stop_appears_in_every_interface(caplog: pytest.LogCaptureFixture) -> None:
    with Simulator(cell=EXAMPLES / "protected.toml", clock="stepped", status_port=0) as simulator:
        simulator.backdoor.push((0.0, 0.0, 100.0, 0.0, 0.0, 0.0))
        simulator.advance(0.1)
        (reason,) = caplog.messages
        assert re.fullmatch(CAUSE, reason), "the log"
        with Iiwa(simulator.host, simulator.port) as robot:
            assert robot.get_error() == (3060, reason)
            status = robot.get_robot_status()
        assert (status.in_error, status.error_code, status.motion_possible) == (1, 3060, 0)
        seen = simulator.call(simulator.backdoor.state)
        assert (seen.error, seen.robot_status) == (ErrorRecord(3060, reason), tuple(status))
        line = on_the_status_port(simulator)
        assert line["error"] == {"code": 3060, "reason": reason}
        assert line["robot_status"] == list(status)
