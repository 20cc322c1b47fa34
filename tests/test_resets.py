"""Clients that close or reset their connection on any port of a robot, at any stage of a message."""

from __future__ import annotations

import contextlib
import signal
import socket

from benchmarks.floods import OPENING, frame
from iiwa_sim.client import Iiwa
from iiwa_sim.server.listening import reset_at_close
from tests.line_client import DEADLINE_S
from tests.processes import Process, running


def request(method: str, path: str, body: str = "", *headers: str) -> bytes:
    length = () if method == "GET" else (f"Content-Length: {len(body)}",)
    head = (f"{method} {path} HTTP/1.1", "Host: 127.0.0.1", *length, *headers, "", "")
    return "\r\n".join(head).encode() + body.encode()


ANSWER_S = 0.01  # for an answer, where there is one
CLOSE = 8
SUBSCRIBED = b'{"op": "subscribe", "topic": "/joint_states"}'
LINES = {
    "iiwa": [b"get status\r\nget mode\r\n", b"nonsense\r\n" * 3000],
    "krc4": [b"<RobotCommand/>", b"<a></b>"],
    "status": [b"stop\r\n", b"GET / HTTP/1.1\r\n\r\n"],
    "backdoor": [
        request("GET", "/state"),
        request("POST", "/advance", '{"seconds": 0.1}'),
        request("POST", "/advance", "x" * 70_000),
    ],
    "rosbridge": [
        b"GET / HTTP/1.1\r\n\r\n",
        OPENING + frame(SUBSCRIBED) + frame(b"\x03\xe8", CLOSE),
        OPENING + frame(b"\xff\xff"),
    ],
}
"""Bytes that a client sends on a port before it resets the connection."""


def goes(process: Process, port: int, line: bytes, stage: str) -> None:
    """A client that is gone before the simulator, halted meanwhile, reads a byte; or when it is answered."""
    halted = stage != "resets, answered"
    if halted:
        process.process.send_signal(signal.SIGSTOP)
    try:
        with socket.create_connection(("127.0.0.1", port), DEADLINE_S) as connection:
            connection.setblocking(not halted)
            connection.send(line)
            if not halted:
                connection.settimeout(ANSWER_S)
                with contextlib.suppress(TimeoutError, ConnectionError):
                    connection.recv(1)
            if stage == "sends no more, resets":
                connection.shutdown(socket.SHUT_WR)
            if stage != "closes":
                reset_at_close(connection)
    finally:
        process.process.send_signal(signal.SIGCONT)


STAGES = ("closes", "resets, answered")
PORTS = ("krc4", "status", "rosbridge", "backdoor")
OPTIONS = "--protocol iiwa,krc4 --status-port 0 --backdoor-port 0 --rosbridge-port 0"


def test_clients_that_disconnect_at_any_moment_are_no_fault() -> None:
    with running(*OPTIONS.split()) as process:
        ports = {"iiwa": process.port}
        for name in PORTS:
            line = process.line().strip().rstrip("/")
            assert name in line
            ports[name] = int(line.rpartition(":")[2])
        for port, line in [(ports[name], line) for name in LINES for line in LINES[name]]:
            for stage in STAGES:
                goes(process, port, line, stage)
            goes(process, port, line[: len(line) // 2], "resets")
        with Iiwa("127.0.0.1", process.port) as robot:
            assert robot.get_status() == "stopped"
        for port in ports.values():
            socket.create_connection(("127.0.0.1", port), DEADLINE_S).close()
        code, log = process.ends(signal.SIGTERM)
    assert code == 0
    assert "error" not in log
    assert "Traceback" not in log
