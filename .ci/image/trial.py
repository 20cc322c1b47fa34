"""What an image has to show: it answers, is healthy, starts fast, and ends when it is asked to.

All of it with a root that cannot be written to and as a user who is not in the image.
"""

import contextlib
import os
import signal
import socket
import time
from collections.abc import Iterator
from pathlib import Path

from engine import Engine, EngineFault

USER = "4711:4711"
BOUND_S = 60.0
"""For what takes a second: only how soon something is wrong is told depends on it."""
EARLY_S = 0.1
GOALS_S = {"start to listening": 0.45, "health check": 0.25}
"""Of CPU time, so that other work on the machine does not count; on a quiet one as much time passes."""
MEASURE = """
import os, subprocess, sys
def spent(pid):
    words = open(f"/proc/{pid}/stat").read().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")
def health():
    before = os.times()
    subprocess.run(sys.argv[1:], check=True)
    after = os.times()
    return after[2] + after[3] - before[2] - before[3]
def start():
    with subprocess.Popen(["iiwa-sim", "--port", "0"], stdout=subprocess.PIPE) as server:
        line = server.stdout.readline()
        took = spent(server.pid)
        server.terminate()
    assert line.startswith(b"listening on "), line
    return took
print(min(start() for _ in range(5)), min(health() for _ in range(5)))
"""


class Container:
    """One that is being started."""

    def __init__(self, engine: Engine, name: str) -> None:
        self._engine, self._name = engine, name

    def is_asked_to_end(self) -> None:
        self._engine("kill", "--signal", "TERM", self._name)

    def exit_code(self) -> int:
        """When it has ended."""
        return int(self._engine("wait", self._name, timeout_s=BOUND_S))

    def does(self, *words: str) -> str:
        """What a command inside prints."""
        return self._engine("exec", self._name, *words, timeout_s=BOUND_S)

    def process(self) -> Path:
        """Of its process 1, as seen from here."""
        return Path("/proc") / str(self._engine.inspect(self._name, "container")["State"]["Pid"])

    def answer(self, port: int, line: bytes) -> bytes:
        """To a line, as soon as it listens."""
        until = time.monotonic() + BOUND_S
        while time.monotonic() < until:
            with (
                contextlib.suppress(ConnectionRefusedError),
                socket.create_connection(("127.0.0.1", port), BOUND_S) as s,
            ):
                s.sendall(line)
                return s.makefile("rb").readline()
            if not self._engine.inspect(self._name, "container")["State"]["Running"]:
                break
            time.sleep(0.05)
        raise EngineFault(f"it does not listen on {port}:\n{self._engine('logs', self._name)}")


@contextlib.contextmanager
def running(engine: Engine, image: str, *options: str, then: tuple[str, ...] = ()) -> Iterator[Container]:
    """A container of the image that is removed at the end."""
    name = f"iiwa-sim-trial-{os.getpid()}-{time.monotonic_ns()}"
    hard = ["--read-only", "--user", USER, "--network", "host", *engine.run_options]
    engine("create", "--name", name, *hard, *options, image, *then)
    try:
        engine("start", name)
        yield Container(engine, name)
    finally:
        engine("rm", "--force", name, needed=False)


def try_image(engine: Engine, image: str, *options: str) -> None:
    """Raises `EngineFault` with what is wrong, and prints what was measured."""
    known = engine.inspect(image, "image")
    check = known.get("Healthcheck") or known["Config"].get("Healthcheck")  # of podman, of docker
    if not check:
        raise EngineFault(f"{image} has no health check")
    command = check["Test"][1:]
    port = free_port()
    listens = ("--host", "127.0.0.1", "--port", str(port))
    with running(engine, image, *options, then=listens) as container:
        _demand(container.answer(port, b"hello\r\n"), b"hello\r\n", "it answers to hello")
        container.does(*command)
        start_s, health_s = map(float, container.does("python", "-c", MEASURE, *command).split())
        container.is_asked_to_end()
        _demand(container.exit_code(), 0, "it ends on SIGTERM with exit code")
    took_s = {"start to listening": start_s, "health check": health_s}
    with running(engine, image, *options, then=listens) as container:
        process = container.process()
        _wait_for_cpu_time(process, EARLY_S)
        os.kill(int(process.name), signal.SIGTERM)  # the engine's way takes as long as the whole start
        _demand(container.exit_code(), 0, f"it ends on SIGTERM {EARLY_S:g} s after its start with exit code")
    told = "".join(f", {what} {took:.2f} s of CPU" for what, took in took_s.items())
    print(f"{image}: {engine.size_mb(image):.0f} MB{told}; SIGTERM, also early: 0", flush=True)
    for what, took in took_s.items():
        if took > GOALS_S[what]:
            raise EngineFault(f"{image}: {what} takes {took:.2f} s of CPU, more than {GOALS_S[what]:g}")


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as free:
        return int(free.getsockname()[1])


def _wait_for_cpu_time(process: Path, seconds: float) -> None:
    """Until it has computed for so long: on a quiet machine that is so much time after its start."""
    until = time.monotonic() + BOUND_S
    while time.monotonic() < until:
        try:
            words = (process / "stat").read_text().rpartition(")")[2].split()
        except OSError as fault:
            raise EngineFault(f"process 1 cannot be seen from here: {fault}") from fault
        if int(words[11]) + int(words[12]) >= seconds * os.sysconf("SC_CLK_TCK"):
            return
    raise EngineFault(f"process 1 has not computed for {seconds:g} s after {BOUND_S:g} s")


def _demand(found: object, expected: object, what: str) -> None:
    if found != expected:
        raise EngineFault(f"{what}: expected {expected!r}, found {found!r}")
