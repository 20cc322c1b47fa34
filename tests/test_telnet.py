"""The real `telnet` program, as a newcomer uses it."""

from __future__ import annotations

import subprocess
import time

import pytest

from iiwa_sim.simulator import Simulator
from tests.line_client import DEADLINE_S
from tests.peers import program
from tests.processes import next_line


@pytest.mark.requirement("FRA003", "FRA004", "FRA006")
def test_a_telnet_session(caplog: pytest.LogCaptureFixture) -> None:
    with Simulator() as simulator:
        command = [program("telnet"), "127.0.0.1", str(simulator.port)]
        pipe = subprocess.PIPE
        with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, bufsize=1) as telnet:

            def asks(line: str) -> str:
                assert telnet.stdin is not None
                telnet.stdin.write(f"{line}\n")
                return next_line(telnet).rstrip("\r\n")

            while not next_line(telnet).startswith("Escape character is"):
                pass
            assert asks("hello") == "hello"
            assert asks("get joint position") == "0.0 0.523598776 0.0 -1.047197551 0.0 1.570796327 0.0"
            assert asks("joint move : 0.01 0.5 0 -1 0 1.5 0 1 1 1 1 1 1 1") == "done"
            give_up = time.monotonic() + DEADLINE_S
            while (status := asks("get status")) == "moving":
                assert time.monotonic() < give_up
            assert status == "stopped"
            assert asks("get joint position") == "0.01 0.5 0.0 -1.0 0.0 1.5 0.0"
            assert asks("go home, robot") == "unknown command"
            assert asks("lin move : up") == "error"
            assert asks("") == "unknown command"
            assert asks("BYE") == "bye"
            assert telnet.wait(DEADLINE_S) is not None
    assert "refused 'lin move : up'" in caplog.text, "the log has the reason"
