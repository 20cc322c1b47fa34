"""`iiwa-sim` as a process of its own."""

from __future__ import annotations

import logging
import re
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from iiwa_sim.cli import main
from iiwa_sim.cli.parsing import from_command_line
from iiwa_sim.options.model import Settings
from iiwa_sim.options.sources import from_environment, merged, robots_of
from tests.line_client import DEADLINE_S

IIWA_SIM = (sys.executable, "-m", "iiwa_sim")


class Process:
    """A process of `iiwa-sim`, which listens on `port` if that is known."""

    def __init__(self, process: subprocess.Popen[str], port: int = 0) -> None:
        self.process = process
        self.port = port

    def line(self) -> str:
        """Return its next line on stdout; see `next_line`."""
        return next_line(self.process)

    def ends(self, signal_number: int) -> tuple[int, str]:
        """Send a signal; return exit code and stderr."""
        self.process.send_signal(signal_number)
        _, written = self.process.communicate(timeout=DEADLINE_S)
        return self.process.returncode, written


def ended(command: Sequence[str | Path], **more: Any) -> subprocess.CompletedProcess[str]:
    """Run a program to its end; return exit code and output."""
    return subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S, check=False, **more)


def succeeds(command: Sequence[str | Path], **more: Any) -> str:
    """Return the stdout of a program that ends with exit code 0."""
    done = ended(command, **more)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def fails(*options: str | Path, program: Sequence[str] = IIWA_SIM) -> str:
    """Return the line of a call that fails: exit code 2, nothing on stdout."""
    done = ended([*program, *options])
    return _one_line(done.returncode, done.stdout, done.stderr)


def refused(*options: str | Path) -> str:
    """Return the line of a call that fails, by the same rules, within this process."""
    handlers = logging.getLogger().handlers
    before = list(handlers)
    with TemporaryFile("w+") as out, TemporaryFile("w+") as err:
        with redirect_stdout(out), redirect_stderr(err):
            try:
                code = main([str(each) for each in options])
            except SystemExit as ends:
                code = int(str(ends.code))
        handlers[:] = before  # what the program logs to ends here
        out.seek(0)
        err.seek(0)
        return _one_line(code, out.read(), err.read())


def _one_line(code: int, out: str, err: str) -> str:
    assert (code, out) == (2, ""), err
    assert re.fullmatch(r"iiwa-sim[^\n]*: [^\n]+\n", err)
    return err


@contextmanager
def started(*command: str | Path, stderr: int = subprocess.PIPE) -> Iterator[Process]:
    """A program; it is killed at the end if it is still there."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=stderr, text=True) as process:
        try:
            yield Process(process)
        finally:
            process.kill()


@contextmanager
def running(
    *options: str, program: tuple[str, ...] = IIWA_SIM, stderr: int = subprocess.PIPE
) -> Iterator[Process]:
    """An `iiwa-sim --port 0 OPTIONS` that listens; it is killed at the end if it is still there."""
    with started(*program, "--port", "0", *options, stderr=stderr) as process:
        line = process.line()
        assert line.startswith(("listening on 127.0.0.1:", "krc4 on 127.0.0.1:")), line
        process.port = int(line.rsplit(":", 1)[1])
        yield process


def next_line(process: subprocess.Popen[str]) -> str:
    """Return its next line on stdout; "" after its end, also for want of output within DEADLINE_S."""
    assert process.stdout is not None
    with killed_unless_done(process):
        return process.stdout.readline()


@contextmanager
def killed_unless_done(process: subprocess.Popen[str]) -> Iterator[None]:
    """Kill a process after DEADLINE_S, so that a caller that waits for its output sees its end."""
    timer = threading.Timer(DEADLINE_S, process.kill)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def robots(*words: str, **environment: str) -> dict[str, Settings]:
    """Return the settings of each robot that a command line and variables ask for, by its name."""
    return robots_of(merged(from_environment(environment)[0], from_command_line(words)))
