"""The backdoor over HTTP, on real sockets: calls like those of its methods, and rejected clients."""

from __future__ import annotations

import http.client
import json
import socket
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import msgspec
import pytest

from iiwa_sim.backdoor.client import BackdoorClient
from iiwa_sim.backdoor.http import CALLS, MOST_CONNECTIONS
from iiwa_sim.cell.bodies import BoxSettings, PlaneSettings, SphereSettings
from iiwa_sim.cell.cell import robot_alone
from iiwa_sim.controller.errors import Refused
from iiwa_sim.controller.requests import Kind, MoveRequest
from iiwa_sim.frames import Frame
from iiwa_sim.protocols import faults as wire
from iiwa_sim.simulator import Simulator
from tests.backdoor.bench import HANDLED, IIWA
from tests.line_client import DEADLINE_S, wait_until

TOKEN = "swordfish"
POSE = {"x_mm": 600.0, "y_mm": 300.0, "z_mm": 150.0, "alpha": 0.1, "stiffness_n_per_m": 5e4}
PLACE = (0.1, 0.2, 0.3, -1.0, 0.5, 1.0, 0.7)
# Each call with its arguments, in an order in which none is rejected.
EXAMPLES: list[tuple[str, dict[str, Any]]] = [
    ("save_state", {"name": "Würfel"}),
    ("pause", {}),
    ("set_clock", {"name": "10x"}),
    ("get_clock", {}),
    ("set_clock", {"name": "stepped"}),
    ("pause", {"paused": False}),
    ("push", {"wrench": (1, 2, 3, 4, 5, 6)}),
    ("push_joints", {"torques": (1, 2, 3, 4, 5, 6, 7)}),
    ("release", {}),
    ("remove_part", {"name": "disc"}),
    ("add_surface", {"surface": PlaneSettings(name="floor", z_mm=-10, stiffness_n_per_m=1e5)}),
    ("add_surface", {"surface": BoxSettings(name="box", size_mm=(10, 20, 30), **POSE)}),
    ("add_surface", {"surface": SphereSettings(name="Würfel", radius_mm=40, **POSE)}),
    ("move_surface", {"name": "Würfel", "pose": Frame(1, 2, -30, 0, 0, 0.5)}),
    ("remove_surface", {"name": "floor"}),
    ("cell", {}),
    ("set_tool", {"tool_in_flange": Frame(1, 2, 100, 0, 0.5, 0)}),
    ("set_input", {"number": 3, "on": True}),
    ("place", {"joints": PLACE}),
    ("set_override", {"override": 0.25}),
    ("robot", {}),
    ("state", {}),
    ("moves", {}),
    ("states", {}),
    ("seed", {"seed": 7}),
    ("stick_jaws", {"stuck": True}),
    ("wrong_sensor", {"sensor": "holds", "on": True}),
    ("refuse_next_move", {"code": 3021}),
    ("reply", {"command": "get status", "reply": "moving", "times": 2}),
    ("connections", {}),
    ("set_fault", {"fault": wire.Pass(), "connection": 0, "replies": 3}),
    ("set_fault", {"fault": wire.Delay(0.5), "connection": -1, "replies": 2}),
    ("set_fault", {"fault": wire.Split(3, 0.1)}),
    ("set_fault", {"fault": wire.Drop(), "replies": 1}),
    ("set_fault", {"fault": wire.ResetBefore()}),
    ("set_fault", {"fault": wire.Silence()}),
    ("close_connections", {}),
    ("close_connections", {"connection": 0, "reset": True}),
    ("refuse_connections", {}),
    ("refuse_connections", {"refused": False}),
    ("clear_faults", {}),
    ("emergency_stop", {}),
    ("emergency_stop", {"pressed": False}),
    ("reset_error", {}),
    ("switch_drives", {"on": False}),
    ("fail", {"code": 3060, "reason": "protective stop"}),
    ("restore_state", {"name": "Würfel"}),
]
NEED_A_MOVE = {"lose_part"}
TAKE_TIME = {"advance", "run_until_stopped"}


@pytest.fixture(scope="module")
def shared() -> Iterator[Simulator]:
    with Simulator(clock="stepped", backdoor_port=0) as simulator:
        yield simulator


@pytest.fixture
def bench(shared: Simulator) -> Iterator[BackdoorClient]:
    yield client_of(shared)
    shared.backdoor.restore_state("start")


def client_of(simulator: Simulator, **options: Any) -> BackdoorClient:
    assert simulator.backdoor_port is not None
    return BackdoorClient("127.0.0.1", simulator.backdoor_port, **options)


def seen(simulator: Simulator) -> dict[str, Any]:
    """Return all that calls change."""
    backdoor = simulator.backdoor
    return {
        "state": backdoor.state(),
        "cell": backdoor.cell(),
        "tool": simulator.controller.tool_in_flange,
        "states": backdoor.states(),
        "clock": backdoor.get_clock(),
        "faults": [(rule.fault, rule.connection, rule.left) for rule in backdoor._wire.rules],
        "canned": {name: list(each) for name, each in backdoor._wire.canned.replies.items()},
    }


def ask(
    port: int | None, method: str, path: str, body: str | None = None, headers: dict[str, str] | None = None
) -> tuple[int, Any]:
    connection = http.client.HTTPConnection("127.0.0.1", port or 0, timeout=DEADLINE_S)
    try:
        connection.request(method, path, None if body is None else body.encode(), headers or {})
        answer = connection.getresponse()
        return answer.status, json.loads(answer.read())
    finally:
        connection.close()


def test_each_http_call_acts_like_its_method() -> None:
    assert {name for name, _ in EXAMPLES} | NEED_A_MOVE | TAKE_TIME | {"dialogue", "camera"} == set(CALLS)
    cell = replace(robot_alone(IIWA), handled=HANDLED)
    with (
        Simulator(cell=cell, clock="stepped", backdoor_port=0) as near,
        Simulator(cell=cell, clock="stepped", backdoor_port=0) as far,
    ):
        bench = client_of(far)
        for name, arguments in EXAMPLES:
            result = getattr(near.backdoor, name)(**arguments)
            assert getattr(bench, name)(**arguments) == msgspec.json.decode(msgspec.json.encode(result)), name
            assert seen(near) == seen(far), name
        assert bench.advance(0.5) is None
        assert near.state().tick + 250 == far.state().tick
        assert bench.run_until_stopped(1) == 0.0
        with pytest.raises(Refused, match="holds no part"):
            bench.lose_part()


def test_reading_calls_answer_get_requests_and_are_listed(shared: Simulator) -> None:
    port = shared.backdoor_port
    assert ask(port, "GET", "/get_clock") == (200, "stepped")
    assert ask(port, "GET", "/dialogue?since=100000")[1]["lines"] == []
    assert ask(port, "GET", "/state")[1]["mode"] == "unknown"
    assert ask(port, "GET", "/healthz") == (200, {"ok": True})
    status, calls = ask(port, "GET", "/")
    assert (status, set(calls)) == (200, set(CALLS))
    assert calls["set_fault"]["takes"] == ["fault", "connection=0", "replies=0"]
    status, answer = ask(port, "POST", "/emergency_stopp")
    assert (status, answer["error"]["reason"]) == (
        404,
        "there is no call 'emergency_stopp': GET / lists all calls",
    )


@pytest.mark.parametrize(
    ("call", "code", "reason"),
    [
        (lambda b: b.push_joints((1, 2)), 3000, "expected 7 finite numbers"),
        (lambda b: b.push((1, 2)), 3040, "Expected `array` of length 6, got 2 - at `$.wrench`"),
        (lambda b: b.set_fault(wire.Delay(-1)), 3040, "Expected `float` >= 0.0 - at `$.fault.seconds`"),
        (lambda b: b.place((0, 0, 0, 3, 0, 0, 0)), 3023, "A4 at 3 rad is outside"),
        (lambda b: b.reply("get status", "a\nb"), 3000, "expected one line of printable ASCII"),
        (lambda b: b.advance(-1), 3000, "expected"),
    ],
)
def test_what_is_wrong_is_refused_with_its_reason_and_changes_nothing(
    shared: Simulator, bench: BackdoorClient, call: Callable[[BackdoorClient], Any], code: int, reason: str
) -> None:
    before = seen(shared)
    with pytest.raises(Refused) as refused:
        call(bench)
    assert refused.value.code == code
    assert reason in refused.value.reason
    assert seen(shared) == before
    assert before["state"].error.code == 0, "a driver does not learn of it"


@pytest.mark.parametrize(
    ("sent", "status"),
    [
        (b"rubbish !\r\n", 400),
        (b"POST /push HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 2\r\n\r\n[]", 400),
        (b"POST /push HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 99999999999\r\n\r\n", 413),
        (b"POST /push HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 413),
        (b"POST /push HTTP/1.1\r\nContent-Length: 0\r\n\r\n", 403),
        (b"GET /emergency_stop HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", 405),
        (b"DELETE / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", 501),
        (b"GET /state HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n", 200),
        (
            b"POST /push HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\nContent-Length: 60000\r\n\r\n"
            + b'{"a":' * 12_000,
            400,
        ),
    ],
)
def test_malformed_requests_have_their_status(shared: Simulator, sent: bytes, status: int) -> None:
    with socket.create_connection(("127.0.0.1", shared.backdoor_port or 0), DEADLINE_S) as connection:
        connection.sendall(sent)
        connection.shutdown(socket.SHUT_WR)
        answer = connection.makefile("rb").readline()
    assert answer.startswith(b"HTTP/1.1 %d " % status)
    assert shared.state().error.code == 0


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "rebound.example"},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
    ],
)
def test_web_pages_are_rejected(shared: Simulator, headers: dict[str, str]) -> None:
    assert ask(shared.backdoor_port, "POST", "/emergency_stop", "{}", headers)[0] == 403
    assert shared.state().error.code == 0


def test_with_a_token_only_its_holder_is_admitted_under_any_host_name() -> None:
    named = {"Host": "robot-0.robots:30080"}
    with Simulator(
        clock="stepped", backdoor_port=0, backdoor_host="0.0.0.0", backdoor_token=TOKEN
    ) as simulator:
        port = simulator.backdoor_port
        for given in ("", TOKEN, f"Basic {TOKEN}", "Bearer", "Bearer swordfis", f"Bearer {TOKEN} {TOKEN}"):
            status, answer = ask(port, "POST", "/emergency_stop", "{}", named | {"Authorization": given})
            assert (status, TOKEN in str(answer)) == (401, False), given
        assert ask(port, "GET", "/state", headers=named)[0] == 401
        assert ask(port, "GET", "/healthz", headers=named)[0] == 200
        assert ask(port, "GET", "/healthz/state", headers=named)[0] == 401
        known = named | {"Authorization": f"bearer {TOKEN}"}
        assert (
            ask(port, "POST", "/emergency_stop", "{}", known | {"Origin": "https://evil.example"})[0] == 403
        )
        with pytest.raises(Refused, match="expected the header 'Authorization: Bearer TOKEN'"):
            client_of(simulator).emergency_stop()
        assert simulator.state().error.code == 0
        assert ask(port, "POST", "/emergency_stop", "{}", known)[0] == 200
        assert client_of(simulator, token=TOKEN).state()["error"]["code"] == 3030


def test_connections_beyond_the_limit_are_closed_and_existing_ones_served(shared: Simulator) -> None:
    address = ("127.0.0.1", shared.backdoor_port or 0)
    first = http.client.HTTPConnection(*address, timeout=DEADLINE_S)
    others = [socket.create_connection(address, DEADLINE_S) for _ in range(MOST_CONNECTIONS - 1)]
    first.request("GET", "/states")
    assert first.getresponse().read() == b'["start"]\n'
    with socket.create_connection(address, DEADLINE_S) as late:
        assert late.makefile("rb").readline().startswith(b"HTTP/1.1 503 ")
    first.request("GET", "/states")
    assert first.getresponse().read() == b'["start"]\n'
    for each in (first, *others):
        each.close()

    def serves() -> bool:
        with socket.create_connection(address, DEADLINE_S) as again:
            again.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
            return again.makefile("rb").readline().startswith(b"HTTP/1.1 200 ")

    wait_until(serves)


def test_a_call_under_way_ends_with_the_robot(caplog: pytest.LogCaptureFixture) -> None:
    with ThreadPoolExecutor(1) as pool:
        with Simulator(clock="stepped", backdoor_port=0) as simulator:
            simulator.call(lambda: simulator.controller.move(MoveRequest(Kind.PTP, PLACE, speeds=[1e-4] * 7)))
            call = pool.submit(client_of(simulator).advance, 86400)
            wait_until(lambda: simulator.state().tick > 0)
        with pytest.raises(ConnectionError):
            call.result(DEADLINE_S)
    assert "internal error" not in caplog.text
