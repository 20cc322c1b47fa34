"""The backdoor from other machines, containers and languages: host, token, and HTTP, on real sockets."""

from __future__ import annotations

import http.client
import json
import socket
import sys
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from iiwa_sim.client import Iiwa
from iiwa_sim.simulator import Simulator
from tests.processes import fails, running
from tests.talking import DEADLINE_S

TOKEN = "swordfish"


@pytest.fixture
def simulator() -> Iterator[Simulator]:
    with Simulator(
        clock="stepped", backdoor_port=0, backdoor_http_port=0, backdoor_host="0.0.0.0", backdoor_token=TOKEN
    ) as simulator:
        yield simulator


def other_address() -> str:
    """An address of this machine that is not the one the robot listens on: all of 127/8 are its own."""
    return "127.0.0.2"


def ask(port: int | None, method: str, path: str, body: object = None, **headers: str) -> tuple[int, object]:
    assert port is not None
    connection = http.client.HTTPConnection(other_address(), port, timeout=DEADLINE_S)
    try:
        connection.request(method, path, None if body is None else json.dumps(body), headers)
        answer = connection.getresponse()
        return answer.status, json.loads(answer.read())
    finally:
        connection.close()


def test_by_http_from_another_address_with_the_token_only(simulator: Simulator) -> None:
    port, known = simulator.backdoor_http_port, {"Authorization": f"Bearer {TOKEN}"}
    assert ask(port, "GET", "/healthz") == (200, {"ok": True})
    assert ask(port, "POST", "/backdoor/emergency-stop")[0] == 401
    assert simulator.state().error.code == 0
    with Iiwa("127.0.0.1", simulator.port) as robot:
        robot.joint_move((1, 1, 1, -1.5, 1, 1, 1), (0.1,) * 7)
        assert ask(port, "POST", "/backdoor/advance", {"time": 0.5}, **known) == (200, {"reply": "done"})
        assert ask(port, "GET", "/state", **known)[1] == json.loads(json.dumps(as_json(simulator)))
        assert ask(port, "POST", "/backdoor/emergency-stop", **known) == (200, {"reply": "done"})
        assert robot.get_error().code == 3030
        _, said = ask(port, "GET", "/dialogue", **known)
        assert isinstance(said, dict)
        assert [line["text"] for line in said["lines"] if line["mark"] == "<"][-1].startswith("3030 ")


def as_json(simulator: Simulator) -> object:
    return msgspec.to_builtins(simulator.state(), str_keys=True)


def test_by_lines_from_another_address_with_the_token_first(simulator: Simulator) -> None:
    assert simulator.backdoor_port is not None
    address = (other_address(), simulator.backdoor_port)
    with socket.create_connection(address, DEADLINE_S) as stranger, stranger.makefile("rb") as replies:
        stranger.sendall(b"emergency stop\r\nemergency stop\r\n")
        assert replies.read() == b"error 3040 the first line is not the token\r\n"
    assert simulator.state().error.code == 0
    with socket.create_connection(address, DEADLINE_S) as bench, bench.makefile("rb") as replies:
        bench.sendall(f"{TOKEN}\r\nemergency stop\r\n".encode())
        assert [replies.readline(), replies.readline()] == [b"done\r\n", b"done\r\n"]
    assert simulator.state().error.code == 3030


def test_a_reply_is_lost_by_curl(simulator: Simulator) -> None:
    port, known = simulator.backdoor_http_port, {"Authorization": f"Bearer {TOKEN}"}
    lost = ask(port, "POST", "/backdoor/drop-replies", {"connection": 0, "replies": 1}, **known)
    assert lost == (200, {"reply": "done"})
    with (
        socket.create_connection(("127.0.0.1", simulator.port), DEADLINE_S) as driver,
        driver.makefile("rb") as replies,
    ):
        driver.sendall(b"get mode\r\nhello\r\n")
        assert replies.readline() == b"hello\r\n"


@pytest.mark.slow
def test_as_a_process_with_the_token_in_a_file(tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_text(f"{TOKEN}\n")
    options = ("--backdoor-host", "0.0.0.0", "--backdoor-token-file", str(file))
    with running("--backdoor-http-port", "0", "--log-level", "info", *options) as simulator:
        said, _, port = simulator.line().rpartition(":")
        assert said == "backdoor by HTTP on 0.0.0.0"
        assert ask(int(port), "POST", "/backdoor/hello", Authorization="Bearer swordfisch")[0] == 401
        answer = ask(int(port), "POST", "/backdoor/hello", Authorization=f"Bearer {TOKEN}")
        assert answer == (200, {"reply": "hello"})
        code, told = simulator.ends(15)
    assert code == 0
    assert "expected the header 'Authorization: Bearer TOKEN'" in told
    assert "swordfi" not in told


@pytest.mark.slow
def test_without_the_library_it_is_said_what_to_install() -> None:
    hidden = (
        "import sys; sys.modules['h11'] = None; from iiwa_sim.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    told = fails("--port", "0", "--backdoor-http-port", "0", program=(sys.executable, "-c", hidden))
    assert told == "iiwa-sim: the backdoor by HTTP needs h11: pip install -e '.[http]'\n"
