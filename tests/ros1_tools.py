"""ROS 1 as Debian has it: a master of our own, and the tools of another terminal."""

from __future__ import annotations

import contextlib
import os
import shutil
import socket
import subprocess
import xmlrpc.client
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from iiwa_sim.ros.side import SYSTEM_PACKAGES
from tests.needed import lacks
from tests.processes import IIWA_SIM, succeeds
from tests.talking import DEADLINE_S, wait_until

PROGRAMS = ("rosmaster", "rostopic", "rosservice")
SYSTEM_PYTHON = "/usr/bin/python3"


def needs_ros() -> None:
    if not (SYSTEM_PACKAGES / "rospy").is_dir() or not all(map(shutil.which, PROGRAMS)):
        lacks("ROS 1 of Debian's packages")


class Terminal:
    """Where ROS_MASTER_URI and ROS_PACKAGE_PATH are set."""

    def __init__(self, master_uri: str, home: Path) -> None:
        here = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        self.master_uri = master_uri
        self.environment = here | {
            "HOME": str(home),
            "ROS_MASTER_URI": master_uri,
            "ROS_IP": "127.0.0.1",
            "ROS_PACKAGE_PATH": succeeds([*IIWA_SIM, "ros-package-path"]).strip(),
            "PYTHONUNBUFFERED": "1",
        }

    def starts(self, *command: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            command,
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def runs(self, *command: str) -> tuple[int, str]:
        """Exit code and output."""
        with self.starts(*command) as process:
            try:
                said, _ = process.communicate(timeout=DEADLINE_S)
            finally:
                process.kill()
        return process.returncode, said

    def says(self, *command: str) -> str:
        """The output of what must succeed."""
        code, said = self.runs(*command)
        assert code == 0, said
        return said

    def python(self, script: str) -> str:
        """What a script says in the Python that ROS is installed for."""
        return self.says(SYSTEM_PYTHON, "-c", script)

    def _asks(self, what: str, *values: str) -> Any:
        """The master's answer."""
        with xmlrpc.client.ServerProxy(self.master_uri) as proxy:
            _, _, answer = getattr(proxy, what)("/tests", *values)
        return answer

    def nodes_at(self, topic: str, *, subscribers: bool = False) -> list[str]:
        """The nodes that the master has for a topic."""
        published, subscribed, _ = self._asks("getSystemState")
        nodes: list[str] = dict(subscribed if subscribers else published).get(topic, [])
        return nodes

    @contextmanager
    def hearing(self, topic: str, *options: str) -> Iterator[subprocess.Popen[str]]:
        """A `rostopic echo` that the robot knows of."""
        with self.starts("rostopic", "echo", *options, topic) as echo:
            try:
                wait_until(lambda: echo.poll() is not None or self.nodes_at(topic, subscribers=True) != [])
                assert echo.poll() is None, echo.communicate()[0]
                yield echo
            finally:
                echo.kill()


@contextmanager
def master(home: Path, port: int = 0) -> Iterator[Terminal]:
    """A terminal with a ROS master, at a free port if none is given, which is ended by its id."""
    if not port:
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
    terminal = Terminal(f"http://127.0.0.1:{port}", home)
    with terminal.starts("rosmaster", "--core", "-p", str(port)) as process:

        def listens() -> bool:
            assert process.poll() is None, process.communicate()[0]
            with contextlib.suppress(OSError):
                return terminal.nodes_at("/none") == []
            return False

        try:
            wait_until(listens)
            yield terminal
        finally:
            process.kill()


def _place(uri: str) -> tuple[str, int]:
    parts = urlsplit(uri)
    assert parts.hostname is not None
    assert parts.port is not None
    return parts.hostname, parts.port
