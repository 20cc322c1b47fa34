"""A driver with one socket, as a user might write it."""

import socket
import time

from protocol import line
from robots import POSES


class RobotError(Exception):
    """What the robot refused, and why."""


class Driver:
    """Moves the robot between the poses that have names."""

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.create_connection((host, port), timeout=5.0)
        self._replies = self._socket.makefile("r", newline="\r\n")

    def start(self, pose: str, speed_rel: float = 0.5) -> None:
        """Sends a LIN to a pose."""
        if self._ask("lin move", *POSES[pose], speed_rel, 0.0) != "done":
            raise RobotError(self._ask("get error"))

    def go(self, pose: str, speed_rel: float = 0.5) -> None:
        """Sends a LIN to a pose and waits until the robot stands there."""
        self.start(pose, speed_rel)
        while self._ask("get status") == "moving":
            time.sleep(0.01)

    def tool_frame(self) -> list[float]:
        """The TCP in the base: mm and rad."""
        return [float(word) for word in self._ask("get tool frame").split()]

    def close(self) -> None:
        self._replies.close()
        self._socket.close()

    def _ask(self, name: str, *values: float) -> str:
        self._socket.sendall(line(name, *values))
        return self._replies.readline().strip()
