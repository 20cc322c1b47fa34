"""What floods do to others: a polite client's replies, simulated time, and how soon a stop is a rest.

As many connections as a row says send without end what it says, and throw away what is answered. The same
bytes go to a bare echo server in the same run, and the same polite client asks there. Everything stays on
this machine, and ends after some seconds.
"""

import contextlib
import json
import multiprocessing
import multiprocessing.synchronize
import selectors
import socket
import time
from collections.abc import Iterator
from statistics import median
from typing import NamedTuple

from benchmarks.figures import Figure, Kind, percentile
from benchmarks.peers import ECHO, IIWA_SIM, Line, listening

QUESTION = b"get joint position\r\n"
FLOODERS = (10, 50, 200)
SECONDS = 3.0
SETTLING_S = 0.5
PAUSE_S = 0.005
"""Of the polite client, before it asks again: it asks some 150 times a second."""
CHUNK_BYTES = 65_536
MOVE = "joint move : {} 0.5 0 -1 0 1.5 0 0.1 0.1 0.1 0.1 0.1 0.1 0.1\r\n"
STOPS = 5


def _frame(text: bytes, opcode: int = 1) -> bytes:
    """A masked frame of WebSocket; the mask is all zeros."""
    length = bytes([0x80 | len(text)]) if len(text) < 126 else b"\xfe" + len(text).to_bytes(2, "big")
    return bytes([0x80 | opcode]) + length + b"\0\0\0\0" + text


def _says(operation: str, **fields: object) -> bytes:
    return _frame(json.dumps({"op": operation, **fields}).encode())


_WRONG = {"command_type": "PTP", "pose_type": "JOINTS", "pose": [0.1] * 7, "velocity": []}
OPENING = (
    b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)


class Flood(NamedTuple):
    """What is sent where, and what the connection begins with."""

    port: str
    what: str
    message: bytes
    opening: bytes = b""


FLOODS = (
    Flood("iiwa", "rubbish", b"rubbish !\r\n"),
    Flood("iiwa", "valid queries", QUESTION),
    Flood("krc4", "valid queries", b'<Cmd I0="1" I1="310"/>\r\n'),
    Flood("backdoor", "rubbish", b"rubbish !\r\n"),
    Flood("status", "noise", b"x" * 60 + b"\r\n"),
    Flood("rosbridge", "pings", _frame(b"", 9), OPENING),
    Flood("rosbridge", "calls", _says("call_service", service="/get_io", args={"number": 1}), OPENING),
    Flood(
        "rosbridge",
        "lists",
        _says("publish", topic="/command_list", msg={"commands": [_WRONG] * 200}),
        OPENING,
    ),
)


def measure() -> list[Figure]:
    """All floods in all numbers."""
    return [figure for flood in FLOODS for count in FLOODERS for figure in _flooded(flood, count)]


def gate() -> list[Figure]:
    """Those that CI has the time for."""
    return [figure for flood in FLOODS for figure in _flooded(flood, FLOODERS[0])]


def _flooded(flood: Flood, count: int) -> list[Figure]:
    with listening(ECHO) as echo, _flooding(echo, flood, count, opens=False):
        of_echo = _replies_us(echo)
    with _simulator() as ports:
        address = ports["iiwa"]
        with _flooding(ports[flood.port], flood, count, opens=True):
            begun, simulated_s = time.perf_counter(), _simulated_s(ports["status"])
            of_sim = _replies_us(address)
            passed_s = _simulated_s(ports["status"]) - simulated_s
            share = passed_s / (time.perf_counter() - begun)
            stopped_ms = max(_stop_ms(address) for _ in range(STOPS))
    name = f"{count} x {flood.what} at {flood.port}"
    return [
        Figure(f"{name}: another's reply, p50", median(of_sim), "us", median(of_echo)),
        Figure(
            f"{name}: another's reply, p99",
            percentile(of_sim, 0.99),
            "us",
            percentile(of_echo, 0.99),
            ratio_at_most=3.0,
            kind=Kind.RATIO,
            margin=2.0,  # a percentile of some hundred
        ),
        Figure(f"{name}: simulated time over real", share, "", at_least=0.98, kind=Kind.WALL),
        Figure(f"{name}: stop to rest, longest", stopped_ms, "ms", at_most=150.0, kind=Kind.WALL),
    ]


@contextlib.contextmanager
def _simulator() -> Iterator[dict[str, tuple[str, int]]]:
    """The addresses of its ports, by their names."""
    ports = {}
    with contextlib.ExitStack() as free:
        for name in ("krc4", "status", "rosbridge", "backdoor"):
            ports[name] = free.enter_context(socket.create_server(("127.0.0.1", 0))).getsockname()[1]
    options = ["--dialect", "iiwa,krc4", "--port", f"0,{ports['krc4']}", "--log-level", "error"]
    for name in ("status", "rosbridge", "backdoor"):
        options += [f"--{name}-port", str(ports[name])]
    command = [*IIWA_SIM[:-2], *options]
    with listening(command) as address:
        yield {"iiwa": address} | {name: ("127.0.0.1", port) for name, port in ports.items()}


def _replies_us(address: tuple[str, int]) -> list[float]:
    with Line(*address) as line:
        end, taken = time.perf_counter() + SECONDS, []
        while time.perf_counter() < end:
            time.sleep(PAUSE_S)
            taken.append(line.timed(QUESTION)[0])
    return taken


def _simulated_s(address: tuple[str, int]) -> float:
    """The time of the newest state."""
    with socket.create_connection(address, timeout=30) as connection, connection.makefile("rb") as lines:
        time_s: float = json.loads(lines.readline())["time_s"]
    return time_s


def _stop_ms(address: tuple[str, int]) -> float:
    """From the command until the robot says that it rests."""
    with Line(*address) as line:
        for target in (-1.5, 1.5):
            line.ask(MOVE.format(target).replace("0.1 ", "1 ").encode())
        time.sleep(0.3)
        begun = time.perf_counter()
        line.ask(b"stop\r\n")
        while line.ask(b"get status\r\n") == b"moving\r\n":
            time.sleep(PAUSE_S)
        return 1e3 * (time.perf_counter() - begun)


@contextlib.contextmanager
def _flooding(address: tuple[str, int], flood: Flood, count: int, *, opens: bool) -> Iterator[None]:
    """A process that floods until the context ends."""
    begun = multiprocessing.Event()
    flooders = multiprocessing.Process(target=_flood, args=(address, flood, count, opens, begun), daemon=True)
    flooders.start()
    try:
        if not begun.wait(30.0):
            raise RuntimeError("the flood did not begin")
        time.sleep(SETTLING_S)
        yield
    finally:
        flooders.terminate()
        flooders.join()


def _flood(
    address: tuple[str, int],
    flood: Flood,
    count: int,
    opens: bool,
    begun: "multiprocessing.synchronize.Event",
) -> None:
    data = flood.message * (CHUNK_BYTES // len(flood.message) + 1)
    rests: dict[socket.socket, memoryview] = {}
    with selectors.DefaultSelector() as selector:
        for _ in range(count):
            connection = socket.create_connection(address, timeout=30)
            if opens and flood.opening:
                connection.sendall(flood.opening)
                while b"\r\n\r\n" not in connection.recv(4096):
                    pass
            connection.setblocking(False)
            rests[connection] = memoryview(data)
            selector.register(connection, selectors.EVENT_READ | selectors.EVENT_WRITE)
        begun.set()
        while selector.get_map():
            for key, events in selector.select():
                connection = key.fileobj
                try:
                    if events & selectors.EVENT_READ and not connection.recv(CHUNK_BYTES):
                        raise ConnectionError("the server has gone")
                    if events & selectors.EVENT_WRITE:
                        rests[connection] = rests[connection][
                            connection.send(rests[connection]) :
                        ] or memoryview(data)
                except BlockingIOError:
                    pass
                except ConnectionError:
                    selector.unregister(connection)
