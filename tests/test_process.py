"""`iiwa-sim` as a process: output, exit codes, log."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Sequence

import pytest

from iiwa_sim.client import Iiwa
from tests.processes import IIWA_SIM, ended, refused, running, started

FAR = ((1, 1, 1, -1.5, 1, 1, 1), (0.1,) * 7)


@pytest.mark.parametrize("number", [signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.slow)])
def test_the_process_ends_in_good_order_while_the_robot_moves(number: int) -> None:
    with running() as simulator, Iiwa("127.0.0.1", simulator.port) as robot:
        robot.joint_move(*FAR)
        assert simulator.ends(number) == (0, "")
        with pytest.raises((OSError, EOFError)):
            robot.get_status()


# Runs the program, and signals itself when the module argv[1] is about to be loaded.
SIGNALLED_WHILE_LOADING = """
import os, signal, sys
from iiwa_sim.cli import main
awaited = sys.argv.pop(1)
class Finder:
    def find_spec(name, path, target=None):
        if name == awaited:
            print("signalled", flush=True)
            os.kill(os.getpid(), signal.SIGTERM)
sys.meta_path.insert(0, Finder)
sys.argv[1:] = ["--port", "0", *sys.argv[1:]]
sys.exit(main())
"""


@pytest.mark.parametrize(
    "module",
    [
        "iiwa_sim.cli.serve",
        pytest.param("pinocchio", marks=pytest.mark.slow),
    ],
)
def test_a_signal_during_the_start_ends_the_process(module: str) -> None:
    """Process 1 of a container would otherwise ignore it, or crash while it loads Pinocchio."""
    command = [sys.executable, "-c", SIGNALLED_WHILE_LOADING, module]
    done = ended(command)
    assert (done.stdout, done.returncode, done.stderr) == ("signalled\n", 0, "")


def test_a_port_in_use() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert refused("--port", str(port)) == (
            f"iiwa-sim: cannot listen on 127.0.0.1:{port}: Address already in use"
            ", by a program or another option; port 0, such as --port 0, is any free one\n"
        )


def test_stdout_without_a_reader() -> None:
    read, write = os.pipe()
    os.close(read)
    assert _printed_to(write, "--version") == (2, "iiwa-sim: stdout has no reader\n")


@pytest.mark.parametrize("words", [("--port", "0"), ("--version",)])
def test_stdout_on_a_full_disk(words: Sequence[str]) -> None:
    full = os.open("/dev/full", os.O_WRONLY)
    assert _printed_to(full, *words) == (2, "iiwa-sim: the disk of stdout is full\n")


def _printed_to(stdout: int, *words: str) -> tuple[int, str]:
    """Return exit code and stderr of a program with this stdout, which is closed."""
    done = subprocess.run([*IIWA_SIM, *words], stdout=stdout, stderr=subprocess.PIPE, text=True, check=False)
    os.close(stdout)
    return done.returncode, done.stderr


def test_the_log_as_json() -> None:
    """Two robots in one process; each entry names its robot."""
    with started(*IIWA_SIM, "--count", "2", "--port", "0", "--log-json", "--log-level", "debug") as simulator:
        ports = [int(simulator.line().rpartition(":")[2]) for _ in range(2)]
        with socket.create_connection(("127.0.0.1", ports[1])) as client:
            name = "{}:{}".format(*client.getsockname())
            for line in (b"hello", b"get joint position : 1\x1b[2J\xe2\x80\xae", b'{"level": "error"}'):
                client.sendall(line + b"\n")
                assert client.recv(1024)
            client.sendall(b"bye\r\n")
            while client.recv(1024):
                pass
        code, written = simulator.ends(signal.SIGTERM)
    assert code == 0
    assert written.isascii()
    events = [json.loads(line) for line in written.splitlines()]
    ours = [event for event in events if event.get("session") == name]
    assert [event["level"] for event in ours] == [
        "info", "debug", "debug", "warning", "debug", "info"
    ]  # fmt: skip
    assert {event["robot"] for event in ours} == {"robot-1"}
    assert (ours[1]["line"], ours[1]["reply"]) == ("hello", "hello")
    assert ours[3]["line"] == '{"level": "error"}'
    assert ours[3]["reason"]
    assert {"time", "level", "message"} <= set(events[0])
