"""`iiwa-sim health`, as the health check of a container asks it of process 1."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from iiwa_sim.cli import main
from iiwa_sim.simulator import Simulator


@contextmanager
def started_as(*words: str, **environment: str) -> Iterator[int]:
    """A process with such a command line and variables, and that does nothing; its number."""
    waits = [sys.executable, "-c", "print(flush=True); input()", *words]
    with subprocess.Popen(
        waits, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=os.environ | environment
    ) as process:
        assert process.stdout is not None
        assert process.stdin is not None
        process.stdout.readline()  # only then it has its command line for sure
        yield process.pid
        process.stdin.write(b"\n")


def test_a_server_is_asked_in_all_its_protocols_on_the_ports_of_its_command_line() -> None:
    with Simulator(protocol=["krc4", "iiwa"]) as robot:
        ports = ",".join(str(robot.ports[name]) for name in ("krc4", "iiwa"))
        with started_as("iiwa-sim", "--protocol", "krc4,iiwa", "--port", ports) as process:
            assert main(["health", str(process)]) == 0


def test_of_several_robots_the_first_is_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with Simulator(protocol=["krc4"]) as first:
        file = tmp_path / "fleet.toml"
        file.write_text(f"[robot.a]\nprotocol = 'krc4'\nport = {first.port}\n[robot.b]\nport = 1\n")
        with started_as("iiwa-sim", IIWA_SIM_FLEET=str(file)) as process:
            assert main(["health", str(process)]) == 0
        with started_as("iiwa-sim", "--count", "3", "--port", str(first.port)) as process:
            answers = main(["health", str(process)])
    assert (answers, capsys.readouterr().err[:26]) == (1, "iiwa-sim: robot-0 iiwa on ")
