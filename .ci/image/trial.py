"""What an image has to show: it answers, is healthy, starts fast, and ends when it is asked to.

All of it with a root that cannot be written to and as a user who is not in the image.
"""

import contextlib
import http.client
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
GOALS_S = {"start to listening": 0.45, "health check": 0.15}
"""Of CPU time, so that other work on the machine does not count; on a quiet one as much time passes."""
GOAL_MB = 140
MOST_MB = 145  # held: each new kernel brings a tenth of one, and the goal is told with what there is
"""Of the layers on top of the base, of the image without ROS."""
TOKEN = "swordfish"
DOMAIN = 96
"""Of DDS, which the tests do not have."""
ROS2_USER = """
import sys, time
import rclpy
from control_msgs.action import FollowJointTrajectory
from rclpy.action import ActionClient
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

PATIENCE_S = 50.0
end_s = time.monotonic() + PATIENCE_S

def until(holds):
    while not holds():
        if time.monotonic() > end_s:
            sys.exit("the robot is not there, or does not go")
        rclpy.spin_once(node, timeout_sec=0.1)

rclpy.init()
node, states = rclpy.create_node("user"), []
node.create_subscription(JointState, "joint_states", states.append, 10)
client = ActionClient(node, FollowJointTrajectory, "joint_trajectory_controller/follow_joint_trajectory")
until(lambda: states and client.server_is_ready())
print(*states[-1].name)
point = JointTrajectoryPoint(positions=[each + 0.1 for each in states[-1].position])
point.time_from_start.sec = 1
trajectory = JointTrajectory(joint_names=states[-1].name, points=[point])
sent = client.send_goal_async(FollowJointTrajectory.Goal(trajectory=trajectory))
until(sent.done)
ended = sent.result().get_result_async()
until(ended.done)
print(ended.result().status, ended.result().result.error_code)
node.destroy_node()
rclpy.shutdown()
"""
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
    hard = ["--read-only", "--user", USER, "--cap-drop", "ALL", "--network", "host", *engine.run_options]
    engine("create", "--name", name, *hard, *options, image, *then)
    try:
        engine("start", name)
        yield Container(engine, name)
    finally:
        engine("rm", "--force", name, needed=False)


def try_image(engine: Engine, image: str, *options: str, base_mb: float | None = None) -> None:
    """Raises `EngineFault` with what is wrong, and prints what was measured.

    With the size of the base, what comes on top of it is held to its goal, too.
    """
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
    _is_steered_from_outside(engine, image, *options)
    told = "".join(f", {what} {took:.2f} s of CPU (goal {GOALS_S[what]:g})" for what, took in took_s.items())
    size_mb = engine.size_mb(image)
    layers = "" if base_mb is None else f", {size_mb - base_mb:.0f} MB of them ours (goal {GOAL_MB})"
    print(f"{image}: {size_mb:.0f} MB{layers}{told}; SIGTERM, also early: 0", flush=True)
    if base_mb is not None and size_mb - base_mb > MOST_MB:
        raise EngineFault(f"{image}: {size_mb - base_mb:.0f} MB are ours, more than {MOST_MB}")
    for what, took in took_s.items():
        if took > GOALS_S[what]:
            raise EngineFault(f"{image}: {what} takes {took:.2f} s of CPU, more than {GOALS_S[what]:g}")


def try_page(engine: Engine, image: str) -> None:
    """As `try_image`, of an image that serves the page, which is to be had with the token only."""
    told = ("--env", f"IIWA_SIM_VIEW_TOKEN={TOKEN}")
    try_image(engine, image, *told, "--env", "IIWA_SIM_VIEW_PORT=0")
    port, page_port = free_port(), free_port()
    variables = (*told, "--env", f"IIWA_SIM_PORT={port}", "--env", f"IIWA_SIM_VIEW_PORT={page_port}")
    with running(engine, image, *variables) as container:
        _demand(container.answer(port, b"hello\r\n"), b"hello\r\n", "with the page, it answers hello")
        _demand(_page(page_port, {}), (401, False), "the page is answered without the token with")
        _demand(_page(page_port, {"Authorization": f"Bearer {TOKEN}"}), (200, True), "and with it with")


def try_ros2(engine: Engine, image: str) -> None:
    """As `try_image`, of an image with a node of ROS 2, whose robot a user's node inside sees and moves."""
    # Containers here share the network of the machine, beyond which nobody is to be met.
    alone = ("--env", "ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST", "--env", f"ROS_DOMAIN_ID={DOMAIN}")
    try_image(engine, image, *alone)
    port = free_port()
    with running(engine, image, *alone, "--env", f"IIWA_SIM_PORT={port}") as container:
        _demand(container.answer(port, b"hello\r\n"), b"hello\r\n", "with ROS 2, it answers hello")
        told = container.does("/opt/ros2/bin/python", "-c", ROS2_USER)
        _demand(
            told, "A1 A2 A3 A4 A5 A6 A7\n4 0\n", "a node inside is told the joints, and the end of a goal"
        )


def _page(port: int, headers: dict[str, str]) -> tuple[int, bool]:
    """Status of the page at another address, and whether it brings its program along."""
    connection = http.client.HTTPConnection("127.0.0.2", port, timeout=BOUND_S)
    try:
        connection.request("GET", "/", headers=headers)
        answer = connection.getresponse()
        return answer.status, b"<script" in answer.read()
    except (OSError, http.client.HTTPException) as fault:
        raise EngineFault(f"the page does not answer: {fault}") from None
    finally:
        connection.close()


def _is_steered_from_outside(engine: Engine, image: str, *options: str) -> None:
    """The backdoor over HTTP, set up by variables: from another address, and by who knows the token only."""
    port, http_port = free_port(), free_port()
    backdoor = {"HTTP_PORT": http_port, "HOST": "0.0.0.0", "TOKEN": TOKEN}
    variables = {"PORT": port, **{f"BACKDOOR_{name}": value for name, value in backdoor.items()}}
    given = [word for name, value in variables.items() for word in ("--env", f"IIWA_SIM_{name}={value}")]
    with running(engine, image, *options, *given) as container:
        _demand(container.answer(port, b"hello\r\n"), b"hello\r\n", "set up by variables, it answers hello")
        _demand(_status(http_port, {}), 401, "an emergency stop without the token is answered")
        told = container.answer(port, b"get error\r\n")
        _demand(told, b"0 none\r\n", "nothing has happened, so get error is")
        _demand(_status(http_port, {"Authorization": f"Bearer {TOKEN}"}), 200, "one with it is answered")
        told = container.answer(port, b"get error\r\n")
        _demand(told, b"3030 emergency stop\r\n", "and get error is")


def _status(port: int, headers: dict[str, str]) -> int:
    """Of the answer to an emergency stop, asked for at another address than the one for clients."""
    connection = http.client.HTTPConnection("127.0.0.2", port, timeout=BOUND_S)
    try:
        connection.request("POST", "/backdoor/emergency-stop", headers=headers)
        return connection.getresponse().status
    finally:
        connection.close()


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
