"""Requests of web pages, and unread logs and transcripts, with a simulator as a process."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from benchmarks.floods import OPENING
from iiwa_sim import Simulator
from iiwa_sim.client import Iiwa
from tests.line_client import DEADLINE_S

FROM_A_PAGE = (
    b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: text/plain\r\nContent-Length: 20\r\n\r\n"
    b"set override : 0.5\r\n"
)


def said_to(port: int, data: bytes) -> bytes:
    """Return all bytes before the connection is closed."""
    with socket.create_connection(("127.0.0.1", port), DEADLINE_S) as connection:
        connection.sendall(data)
        answer = b""
        try:
            while more := connection.recv(4096):
                answer += more
        except ConnectionResetError:
            pass
        return answer


def test_connections_of_web_pages_are_closed_with_one_line_in_the_log(
    caplog: pytest.LogCaptureFixture,
) -> None:
    with Simulator(protocol=["iiwa", "krc4"], status_port=0, backdoor_port=0, rosbridge_port=0) as simulator:
        rosbridge, backdoor = simulator.rosbridge_port, simulator.backdoor_port
        assert simulator.status_port is not None
        assert rosbridge is not None
        assert backdoor is not None
        lines = {**simulator.ports, "status": simulator.status_port, "rosbridge": rosbridge}
        for name, port in lines.items():
            answer = said_to(port, FROM_A_PAGE)
            if name == "rosbridge":
                assert b" 101 " not in answer
            elif name == "status":  # which broadcasts from the beginning
                assert b"HTTP" not in answer
            else:
                assert answer == b""
        foreign = OPENING.replace(b"Upgrade:", b"Origin: https://evil.example\r\nUpgrade:", 1)
        assert said_to(rosbridge, foreign).startswith(b"HTTP/1.1 403 ")
        assert said_to(backdoor, foreign).startswith(b"HTTP/1.1 403 ")
        rebound = OPENING.replace(b"127.0.0.1", b"evil.example")
        assert said_to(rosbridge, rebound).startswith(b"HTTP/1.1 403 ")
        assert said_to(backdoor, rebound).startswith(b"HTTP/1.1 403 ")
        assert simulator.state().override == 1.0
    log = caplog.text
    closed = [line for line in log.splitlines() if "closed: it sent an HTTP request" in line]
    assert len(closed) == 3
    assert log.count("(rosbridge) refused: ") == 2
    assert log.count("https://evil.example") == log.count("the host 'evil.example'") == 1


def test_a_line_of_many_megabytes_is_refused_and_the_next_one_answered() -> None:
    with Simulator() as robot, socket.create_connection((robot.host, robot.port), DEADLINE_S) as client:
        client.sendall(b"x" * 8_000_000)  # letters, with which an HTTP request may begin
        client.sendall(b"\nbye\n")
        assert client.makefile().read() == "error\nbye\n"


def test_a_transcript_to_a_fifo_without_a_reader_stops_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "fifo"
    os.mkfifo(path)
    with (
        Simulator(transcript=path, clock="fast") as simulator,
        Iiwa("127.0.0.1", simulator.port) as robot,
    ):
        for _ in range(150):  # so that all buffers are full
            assert robot.command("hello", 900 * "x") == "hello"
        robot.joint_move([0.1, 0.5, 0, -1.0, 0, 1.5, 0], [1.0] * 7)
        robot.wait_until_stopped(DEADLINE_S)
    assert f"{path}: the last lines are lost: they were not read" in caplog.text
