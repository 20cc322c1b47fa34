"""Effects of a flood on others: latency of another client, simulated time, and the delay of a stop.

For each row, a number of connections send the same message without pause and discard the replies. A bare echo
server gets the same bytes in the same run, and the same client asks there. Slow readers send nothing; their
rows show ticks. Everything stays on this machine and ends after some seconds.
"""

import contextlib
import json
import socket
import time
from collections.abc import Iterator
from statistics import median

from benchmarks.figures import Figure, Kind, percentile
from benchmarks.flooders import Address, Flood, bare, flooding, frame, readers_of_all_states, says, websockets
from benchmarks.peers import ECHO, IIWA_SIM, Line, listening
from iiwa_sim.ros.joint_interface import ACTION

QUESTION = b"get joint position\r\n"
SECONDS = 3.0
PAUSE_S = 0.005
"""Pause of the other client between requests, so that it sends about 150 a second."""
MOVE = "joint move : {} 0.5 0 -1 0 1.5 0 0.1 0.1 0.1 0.1 0.1 0.1 0.1\r\n"
STOPS = 5

_BACK = {
    "joint_names": [f"A{k}" for k in range(1, 8)],
    "points": [{"positions": [0.1] * 7, "time_from_start": {"sec": 200 - k}} for k in range(200)],
}
"""A trajectory whose times go back: all of it is read, and refused."""
_WRONG = {"command_type": "PTP", "pose_type": "JOINTS", "pose": [0.1] * 7, "velocity": []}

FLOODS = (
    Flood("iiwa", "rubbish", b"rubbish !\r\n"),
    Flood("iiwa", "valid queries", QUESTION),
    Flood("krc4", "valid queries", b'<Cmd I0="1" I1="310"/>\r\n'),
    Flood("backdoor", "valid queries", b"GET /get_clock HTTP/1.1\r\nHost: localhost\r\n\r\n"),
    Flood("status", "noise", b"x" * 60 + b"\r\n"),
    Flood("rosbridge", "pings", frame(b"", 9), websockets),
    Flood("rosbridge", "calls", says("call_service", service="/get_io", args={"number": 1}), websockets),
    Flood(
        "rosbridge",
        "lists",
        says("publish", topic="/command_list", msg={"commands": [_WRONG] * 200}),
        websockets,
    ),
    Flood(
        "rosbridge",
        "trajectories",
        says("send_action_goal", action=ACTION, id="one", args={"trajectory": _BACK}),
        websockets,
    ),
)
SLOW = Flood("rosbridge", "slow readers of five topics", b"", readers_of_all_states)


def measure() -> list[Figure]:
    """Measure all floods with ten connections, KRC4 messages with 200, and a hundred slow readers."""
    counts = {"krc4": 200}
    found = [figure for flood in FLOODS for figure in _flooded(flood, counts.get(flood.port, 10))]
    return found + _flooded(SLOW, 100)


def _flooded(flood: Flood, count: int) -> list[Figure]:
    with listening(ECHO) as echo, flooding(echo, flood._replace(connected=bare), count):
        of_echo = _replies_us(echo)
    with _simulator() as ports:
        address = ports["iiwa"]
        with flooding(ports[flood.port], flood, count):
            simulated_s = _simulated_s(ports["status"])
            begun = time.perf_counter()
            of_sim = _replies_us(address)
            passed_s = _simulated_s(ports["status"]) - simulated_s
            took_s = time.perf_counter() - begun
            stopped_ms = max(_stop_ms(address) for _ in range(STOPS))
    name = f"{count} x {flood.what} at {flood.port}"
    return [
        Figure(
            f"{name}: another's reply, p50",
            median(of_sim),
            "us",
            median(of_echo),
            ratio_at_most=3.0 if flood.message else None,  # slow readers do not affect an echo server
            kind=Kind.RATIO,
            margin=20,  # the echo's is 60 or 1,500 us, as processors are given; waiting in line is far more
        ),
        Figure(
            f"{name}: another's reply, p99",
            percentile(of_sim, 0.99),
            "us",
            percentile(of_echo, 0.99),
            ratio_at_most=3.0 if flood.message else None,
            kind=Kind.TAIL,
        ),
        Figure(f"{name}: simulated time over real", passed_s / took_s, "", at_least=0.98, kind=Kind.WALL),
        Figure(f"{name}: stop to rest, longest", stopped_ms, "ms", at_most=150.0, kind=Kind.WALL),
    ]


@contextlib.contextmanager
def _simulator() -> Iterator[dict[str, Address]]:
    """A simulator; yields the addresses of its ports by name."""
    ports = {}
    with contextlib.ExitStack() as free:
        for name in ("krc4", "status", "rosbridge", "backdoor"):
            ports[name] = free.enter_context(socket.create_server(("127.0.0.1", 0))).getsockname()[1]
    options = ["--protocol", "iiwa,krc4", "--port", f"0,{ports['krc4']}", "--log-level", "error"]
    for name in ("status", "rosbridge", "backdoor"):
        options += [f"--{name}-port", str(ports[name])]
    with listening([*IIWA_SIM[:-2], *options]) as address:
        yield {"iiwa": address, **{name: ("127.0.0.1", port) for name, port in ports.items()}}


def _replies_us(address: Address) -> list[float]:
    with Line(*address) as line:
        end, taken = time.perf_counter() + SECONDS, []
        while time.perf_counter() < end:
            time.sleep(PAUSE_S)
            taken.append(line.timed(QUESTION)[0])
    return taken


def _simulated_s(address: Address) -> float:
    """Simulated time of the newest state."""
    with socket.create_connection(address, timeout=30) as connection, connection.makefile("rb") as lines:
        time_s: float = json.loads(lines.readline())["time_s"]
    return time_s


def _stop_ms(address: Address) -> float:
    """Time from the stop command to a state at rest."""
    with Line(*address) as line:
        for target in (-1.5, 1.5):
            line.ask(MOVE.format(target).replace("0.1 ", "1 ").encode())
        time.sleep(0.3)
        begun = time.perf_counter()
        line.ask(b"stop\r\n")
        while line.ask(b"get status\r\n") == b"moving\r\n":
            time.sleep(PAUSE_S)
        return 1e3 * (time.perf_counter() - begun)
