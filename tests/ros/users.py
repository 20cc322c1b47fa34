"""Users of the node of ROS 2, each a process of its own with rclpy."""

from __future__ import annotations

import atexit
import json
import os
import socket
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from iiwa_sim.ros import relay
from iiwa_sim.ros.joint_interface import ACTION, ACTION_TYPE
from iiwa_sim.ros.ros2_env import STAMP, default_folder, python_in
from tests.needed import lacks
from tests.processes import killed_unless_done
from tests.talking import DEADLINE_S

DOMAINS = range(1, 40)
FIRST_LOCK = 23_400
"""A domain of DDS is whose process has bound the port of 127.0.0.1 that is so much more."""
CELL = f"cell_{os.getpid()}"
"""A namespace."""
FOLDER = Path(relay.__file__).parent
PROGRAM = Path(__file__).parent / "user_node.py"
AWAY = (0.2, 0.7, 0.2, -0.9, 0.2, 1.2, 0.2)
HERE = (0.0, 0.523599, 0.0, -1.047198, 0.0, 1.570796, 0.0)
NAMES = [f"A{k}" for k in range(1, 8)]


def rclpy_python(monkeypatch: pytest.MonkeyPatch) -> Path:
    """An interpreter that has rclpy, and a domain that no other worker is in."""
    found = python_in(default_folder())
    if not found.exists():
        lacks("an environment of iiwa-sim ros2-env")
    monkeypatch.setenv("ROS_DOMAIN_ID", str(domain()))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setattr(relay, "END_S", DEADLINE_S)  # a machine may be slow
    return found


@cache
def domain() -> int:
    """A domain of DDS for this process alone: no other worker, and no other run on this machine, is in it.

    In one domain robots of the same name are one, and all have one /clock.
    """
    for number in DOMAINS:
        lock = socket.socket()
        try:
            lock.bind(("127.0.0.1", FIRST_LOCK + number))
        except OSError:
            lock.close()
        else:
            atexit.register(lock.close)
            return number
    raise AssertionError("all domains are in use")


def compiled(python: Path) -> None:
    """The test does not run without the types that no wheel has."""
    if not (python.parent.parent / STAMP).exists():
        lacks("control_msgs in the environment of iiwa-sim ros2-env, which needs a C++ compiler,")


class User:
    """What a user's node is asked to do; each call waits for the answer."""

    def __init__(self, node: subprocess.Popen[str]) -> None:
        self._process = node

    def asks(self, do: str, **what: Any) -> Any:
        """See `user_node.py`; the test fails where that does."""
        node = self._process
        assert node.stdin is not None
        assert node.stdout is not None
        node.stdin.write(json.dumps({"do": do, **what}) + "\n")
        node.stdin.flush()
        with killed_unless_done(node):
            line = node.stdout.readline()
        assert line, "the user's node has ended"
        answer = json.loads(line)
        assert "fault" not in answer, answer["fault"]
        return answer

    def hears(self, topic: str, kind: str, count: int, *, latched: bool = False) -> list[Any]:
        """The next `count` messages of a topic, which the user subscribes to until then."""
        self.asks("hear", topic=topic, kind=kind, latched=latched)
        messages: list[Any] = self.asks("wait", topic=topic, count=count)["messages"]
        self.asks("forget", topic=topic)
        return messages

    def calls(self, service: str, kind: str, **request: Any) -> Any:
        """The response of a service."""
        return self.asks("call", service=service, kind=kind, request=request)["response"]

    def sends(self, name: str, points: Sequence[Any], **fields: Any) -> bool:
        """Send a goal; gives whether it was accepted."""
        goal = {"trajectory": trajectory(points), **fields}
        answer = self.asks("goal", name=name, action=ACTION.lstrip("/"), kind=ACTION_TYPE, goal=goal)
        return bool(answer["accepted"])


@contextmanager
def user(python: Path, namespace: str = CELL) -> Iterator[User]:
    """A user's node; it ends with the block."""
    node = subprocess.Popen(
        [python, PROGRAM, FOLDER, namespace], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    with node:
        try:
            yield User(node)
        finally:
            assert node.stdin is not None
            node.stdin.close()
            with killed_unless_done(node):
                node.wait()


def trajectory(points: Sequence[tuple[float, Sequence[float]]], **fields: Any) -> dict[str, Any]:
    """trajectory_msgs/JointTrajectory of times in s and positions."""
    rows = [{"positions": list(place), "time_from_start": duration(time_s)} for time_s, place in points]
    return {"joint_names": NAMES, "points": rows, **fields}


def duration(time_s: float) -> dict[str, int]:
    """builtin_interfaces/Duration."""
    sec, nanosec = divmod(round(time_s * 10**9), 10**9)
    return {"sec": sec, "nanosec": nanosec}
