"""The real `telnet` program at a terminal, as a newcomer uses it."""

from __future__ import annotations

import os
import pty
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tests.needed import program
from tests.processes import running
from tests.talking import DEADLINE_S

# Runs a program as a shell would: Ctrl-C at the terminal reaches it as a signal.
AT_ITS_TERMINAL = """
import fcntl, os, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
os.execv(sys.argv[1], sys.argv[1:])
"""


class Terminal:
    """Telnet, and whoever sits in front of it."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._shown = ""

    def types(self, text: str) -> None:
        os.write(self._descriptor, text.encode())

    def shows(self, text: str) -> str:
        """Waits until the terminal shows something; all that it showed up to it, which is then done with."""
        while text not in self._shown:
            ready, _, _ = select.select([self._descriptor], [], [], DEADLINE_S)
            assert ready, f"no {text!r} within {DEADLINE_S} s, only {self._shown!r}"
            self._shown += os.read(self._descriptor, 4096).decode()
        before, _, self._shown = self._shown.partition(text)
        return before + text

    def asks(self, command: str) -> str:
        """Types a command; the reply that is shown."""
        self.types(command + "\n")
        self.shows(command + "\r\n")  # the terminal's own echo
        return self.shows("\r\n").removesuffix("\r\n")


@contextmanager
def telnet(port: int) -> Iterator[Terminal]:
    telnet_itself = program("telnet")
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", AT_ITS_TERMINAL, telnet_itself, "127.0.0.1", str(port)],
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        start_new_session=True,
    )
    os.close(theirs)
    with process:
        try:
            yield Terminal(ours)
            process.wait(DEADLINE_S)
        finally:
            process.kill()
            os.close(ours)


@pytest.mark.requirement("FRA003", "FRA004", "FRA006")
def test_a_robot_you_can_telnet_into() -> None:
    with running() as simulator:
        with telnet(simulator.port) as terminal:
            terminal.shows("Escape character is")
            terminal.shows("\r\n")
            assert terminal.asks("hello") == "hello"
            assert (
                terminal.asks("get joint position") == "0.0 0.523598776 0.0 -1.047197551 0.0 1.570796327 0.0"
            )
            assert terminal.asks("joint move : 0.01 0.5 0 -1 0 1.5 0 1 1 1 1 1 1 1") == "done"
            give_up = time.monotonic() + DEADLINE_S
            while (status := terminal.asks("get status")) == "moving":
                assert time.monotonic() < give_up
            assert status == "stopped"
            assert terminal.asks("get joint position") == "0.01 0.5 0.0 -1.0 0.0 1.5 0.0"
            assert terminal.asks("go home, robot") == "unknown command"
            assert terminal.asks("lin move : up") == "error"
            assert terminal.asks("") == "unknown command"
            assert terminal.asks("BYE") == "bye"
            terminal.shows("Connection closed by foreign host.")
        code, said = simulator.ends(signal.SIGTERM)
    assert code == 0
    assert "refused 'lin move : up'" in said, "who runs it sees why"
