"""`iiwa-sim health`, as the health check of a container asks it of process 1."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from iiwa_sim.cli import main
from iiwa_sim.simulator import Simulator
from tests.processes import IIWA_SIM, started


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


def free_ports(count: int) -> list[int]:
    with ExitStack() as taken:
        listeners = [taken.enter_context(socket.create_server(("127.0.0.1", 0))) for _ in range(count)]
        return [listener.getsockname()[1] for listener in listeners]


def test_a_server_is_asked_in_all_its_protocols_on_the_ports_of_its_command_line() -> None:
    ports = ",".join(map(str, free_ports(2)))
    with started(*IIWA_SIM, "--protocol", "krc4,iiwa", "--port", ports) as server:
        assert server.line()
        assert server.line()
        assert main(["health", str(server.process.pid)]) == 0


def test_of_several_robots_the_first_is_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with Simulator(protocol=["krc4"]) as first:
        file = tmp_path / "fleet.toml"
        file.write_text(f"[robot.a]\nprotocol = 'krc4'\nport = {first.port}\n[robot.b]\nport = 1\n")
        with started_as("iiwa-sim", IIWA_SIM_FLEET=str(file)) as process:
            assert main(["health", str(process)]) == 0
        with started_as("iiwa-sim", "--count", "3", "--port", str(first.port)) as process:
            answers = main(["health", str(process)])
    assert (answers, capsys.readouterr().err[:26]) == (1, "iiwa-sim: robot-0 iiwa on ")
