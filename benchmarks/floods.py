"""Effects of a flood on others: latency of another client, simulated time, and the delay of a stop.

In each row, connections send the same message without pause and discard the replies. Slow readers send
nothing. Everything stays on this machine and ends after some seconds.
"""

import contextlib
import json
import multiprocessing
import selectors
import socket
import time
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.synchronize import Event
from typing import NamedTuple

from benchmarks.figure import Figure, percentile
from benchmarks.servers import IIWA_SIM, Line, listening
from iiwa_sim.ros.joint_interface import ACTION

Address = tuple[str, int]
QUESTION = b"get joint position\r\n"
SECONDS = 3.0
PAUSE_S = 0.005
"""Pause of the other client between requests, so that it sends about 150 a second."""
MOVE = "joint move : {} 0.5 0 -1 0 1.5 0 1 1 1 1 1 1 1"
STOPS = 5
SETTLING_S = 0.5
CHUNK_BYTES = 65_536
TOPICS = ("/robot_status", "/tool_frame", "/joint_states", "/current_speed_scale", "/io_states")
OPENING = (
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)
"""Request for a WebSocket."""
SLOW_BYTES, SLOW_S = 2048, 0.1
"""Bytes that a slow reader reads, and how often."""


def bare(address: Address, count: int) -> list[socket.socket]:
    """Open `count` plain connections."""
    return [socket.create_connection(address, timeout=30) for _ in range(count)]


def websockets(address: Address, count: int) -> list[socket.socket]:
    """Open `count` WebSocket connections."""
    connections = bare(address, count)
    for connection in connections:
        connection.sendall(OPENING)
        while b"\r\n\r\n" not in connection.recv(4096):
            pass
    return connections


def readers_of_all_states(address: Address, count: int) -> list[socket.socket]:
    """Open subscribers of five topics of rosbridge with small receive buffers."""
    connections = websockets(address, count)
    for connection in connections:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, SLOW_BYTES)
        for topic in TOPICS:
            connection.sendall(operation("subscribe", topic=topic))
    return connections


def frame(text: bytes, opcode: int = 1) -> bytes:
    """Return a masked WebSocket frame with a mask of zeros."""
    length = bytes([0x80 | len(text)]) if len(text) < 126 else b"\xfe" + len(text).to_bytes(2, "big")
    return bytes([0x80 | opcode]) + length + b"\0\0\0\0" + text


def operation(name: str, **fields: object) -> bytes:
    """A frame with an operation of rosbridge."""
    return frame(json.dumps({"op": name, **fields}).encode())


class Flood(NamedTuple):
    """The message that is sent to a port, empty for slow readers, and the kind and number of connections."""

    port: str
    what: str
    message: bytes
    connected: Callable[[Address, int], Sequence[socket.socket]] = bare
    count: int = 10


_BACK = {
    "joint_names": [f"A{k}" for k in range(1, 8)],
    "points": [{"positions": [0.1] * 7, "time_from_start": {"sec": 200 - k}} for k in range(200)],
}
"""A trajectory whose times go back: all of it is read, and refused."""
_WRONG = {"command_type": "PTP", "pose_type": "JOINTS", "pose": [0.1] * 7, "velocity": []}
_LISTS = operation("publish", topic="/command_list", msg={"commands": [_WRONG] * 200})
_CALLS = operation("call_service", service="/get_io", args={"number": 1})
_GOALS = operation("send_action_goal", action=ACTION, id="one", args={"trajectory": _BACK})
FLOODS = (
    Flood("iiwa", "rubbish", b"rubbish !\r\n"),
    Flood("iiwa", "valid queries", QUESTION),
    Flood("krc4", "valid queries", b'<Cmd I0="1" I1="310"/>\r\n', count=200),
    Flood("backdoor", "valid queries", b"GET /get_clock HTTP/1.1\r\nHost: localhost\r\n\r\n"),
    Flood("status", "noise", b"x" * 60 + b"\r\n"),
    Flood("rosbridge", "pings", frame(b"", 9), websockets),
    Flood("rosbridge", "calls", _CALLS, websockets),
    Flood("rosbridge", "lists", _LISTS, websockets),
    Flood("rosbridge", "trajectories", _GOALS, websockets),
    Flood("rosbridge", "slow readers of five topics", b"", readers_of_all_states, 100),
)


def measure() -> list[Figure]:
    """Measure all floods."""
    return [figure for flood in FLOODS for figure in _flooded(flood)]


def _flooded(flood: Flood) -> list[Figure]:
    with _simulator() as ports, _flooding(ports[flood.port], flood), Line(*ports["iiwa"]) as line:
        simulated_s, begun = _simulated_s(ports["status"]), time.perf_counter()
        taken_us = []
        while time.perf_counter() < begun + SECONDS:
            time.sleep(PAUSE_S)
            taken_us.append(line.latency_us(QUESTION))
        passed_s = _simulated_s(ports["status"]) - simulated_s
        share = passed_s / (time.perf_counter() - begun)
        stopped_ms = max(_stop_ms(line) for _ in range(STOPS))
    name = f"{flood.count} x {flood.what} at {flood.port}"
    p50_ms, p99_ms = (1e-3 * percentile(taken_us, part) for part in (0.5, 0.99))
    return [
        Figure(f"{name}: another's reply, p50", p50_ms, "ms", at_most=20.0, margin=2.0),
        Figure(f"{name}: another's reply, p99", p99_ms, "ms", at_most=120.0),
        Figure(f"{name}: simulated time over real", share, "", at_least=0.9),
        Figure(f"{name}: stop to rest, longest", stopped_ms, "ms", at_most=150.0),
    ]


@contextlib.contextmanager
def _simulator() -> Iterator[dict[str, Address]]:
    """Run a simulator; yield the addresses of its ports by name."""
    ports = {}
    with contextlib.ExitStack() as free:
        for name in ("krc4", "status", "rosbridge", "backdoor"):
            ports[name] = free.enter_context(socket.create_server(("127.0.0.1", 0))).getsockname()[1]
    options = ["--protocol", "iiwa,krc4", "--port", f"0,{ports['krc4']}", "--log-level", "error"]
    for name in ("status", "rosbridge", "backdoor"):
        options += [f"--{name}-port", str(ports[name])]
    with listening([*IIWA_SIM, *options]) as address:
        yield {"iiwa": address, **{name: ("127.0.0.1", port) for name, port in ports.items()}}


def _simulated_s(address: Address) -> float:
    """Simulated time of the newest state."""
    with socket.create_connection(address, timeout=30) as connection, connection.makefile("rb") as lines:
        time_s: float = json.loads(lines.readline())["time_s"]
    return time_s


def _stop_ms(line: Line) -> float:
    """Time from the stop command to a state at rest."""
    for target in (-1.5, 1.5):
        line.asks(MOVE.format(target))
    time.sleep(0.3)
    begun = time.perf_counter()
    line.asks("stop")
    while line.ask(b"get status\r\n") == b"moving\r\n":
        time.sleep(PAUSE_S)
    return 1e3 * (time.perf_counter() - begun)


@contextlib.contextmanager
def _flooding(address: Address, flood: Flood) -> Iterator[None]:
    """Run a process that floods until the context ends."""
    begun = multiprocessing.Event()
    flooders = multiprocessing.Process(target=_flood, args=(address, flood, begun), daemon=True)
    flooders.start()
    try:
        if not begun.wait(60.0):
            raise RuntimeError("the flood did not begin")
        time.sleep(SETTLING_S)
        yield
    finally:
        flooders.terminate()
        flooders.join()


def _flood(address: Address, flood: Flood, begun: Event) -> None:
    connections = flood.connected(address, flood.count)
    begun.set()
    while not flood.message:
        time.sleep(SLOW_S)
        for connection in connections:
            if not connection.recv(SLOW_BYTES):
                raise ConnectionError("the server has gone")
    data = memoryview(flood.message * (CHUNK_BYTES // len(flood.message) + 1))
    rests = dict.fromkeys(connections, data)
    with selectors.DefaultSelector() as selector:
        for connection in connections:
            connection.setblocking(False)
            selector.register(connection, selectors.EVENT_READ | selectors.EVENT_WRITE)
        while selector.get_map():
            for key, events in selector.select():
                connection = key.fileobj
                assert isinstance(connection, socket.socket)
                try:
                    if events & selectors.EVENT_READ and not connection.recv(CHUNK_BYTES):
                        raise ConnectionError("the server has gone")
                    if events & selectors.EVENT_WRITE:
                        rests[connection] = rests[connection][connection.send(rests[connection]) :] or data
                except BlockingIOError:
                    pass
                except ConnectionError:
                    selector.unregister(connection)
