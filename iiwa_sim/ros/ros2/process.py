"""The process that is the node of ROS 2: started, told lines, read, ended.

It is of another interpreter: the wheels of rclpy re-execute every interpreter of their environment and leave
their library path to its children, and a distribution's rclpy fits one Python alone. So what is joined is two
pipes, and nothing of rclpy is loaded here.
"""

import asyncio
import contextlib
import json
import logging
import os
from asyncio.subprocess import PIPE, Process
from collections import deque
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any, Self

import msgspec

from iiwa_sim.ros.conventions import RosFault
from iiwa_sim.wording import harmless, shortened

START_S = 120.0
"""Time (s) after its start in which the process has to become a node."""
END_S = 10.0
"""Time (s) in which the process has to end when it is asked to, before it is killed."""
MOST_UNREAD_BYTES = 1 << 17
"""Bytes that the process may leave unread before messages that recur are left out, so that the rest is not
late."""
LONGEST_LINE_BYTES = 1 << 21
MOST_WAITING = 16
"""Lines that have been read and not been taken; the process waits then, and the newest 10 of a topic in
it."""

Line = dict[str, Any]
logger = logging.getLogger(__name__)
_encode = msgspec.json.Encoder().encode


class NodeProcess:
    """One process, from `start` to `close`."""

    def __init__(
        self, process: Process, on_line: Callable[[], None], on_too_long: Callable[[], None]
    ) -> None:
        self._process = process
        self._on_line = on_line
        self._on_too_long = on_too_long
        self._heard: deque[bytes] = deque()
        self._room = asyncio.Event()
        self._room.set()
        self._tasks = [asyncio.create_task(_told(process))]
        self.without: tuple[str, ...] = ()
        """The names of what has no type in that interpreter."""

    @classmethod
    async def start(
        cls, python: Path, first: Line, on_line: Callable[[], None], on_too_long: Callable[[], None]
    ) -> Self:
        """Start it and wait until it is a node; `first` says what there shall be. Raises RosFault.

        `on_line` is called when there is a line to take, `on_too_long` when one was dropped.
        """
        environment = dict(os.environ)
        environment.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        script = str(files("iiwa_sim.ros.ros2.rclpy_node").joinpath("start.py"))
        try:
            process = await asyncio.create_subprocess_exec(
                *(python, script),
                stdin=PIPE,
                stdout=PIPE,
                stderr=PIPE,
                env=environment,
                limit=LONGEST_LINE_BYTES,
                start_new_session=True,  # a Ctrl-C is for us: the process ends when its input does
            )
        except OSError as fault:
            raise RosFault(f"{python} cannot be run: {fault.strerror}") from None
        node = cls(process, on_line, on_too_long)
        node.say(**first)
        try:
            node.without = tuple((await node._first_line(python))["ready"])
        except BaseException:
            await node.close()
            raise
        node._tasks.append(asyncio.create_task(node._read()))
        return node

    async def ended(self) -> int:
        """Wait until the process has ended; gives its exit code."""
        return await self._process.wait()

    async def close(self) -> None:
        """End the process: it ends when its input does."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        try:
            async with asyncio.timeout(END_S):
                await self._process.wait()
        except TimeoutError:
            with contextlib.suppress(ProcessLookupError):
                self._process.kill()
            await self._process.wait()
        for task in self._tasks:
            task.cancel()
        await asyncio.wait(self._tasks)

    def say(self, **what: Any) -> None:
        """Write a line."""
        stdin = self._process.stdin
        if stdin is not None and not stdin.is_closing():
            stdin.write(_encode(what) + b"\n")

    def offer(self, **what: Any) -> None:
        """Write a line, unless the process is far behind: what is told again and again."""
        stdin = self._process.stdin
        if stdin is not None and stdin.transport.get_write_buffer_size() < MOST_UNREAD_BYTES:
            self.say(**what)

    def next(self) -> Line | None:
        """The next line that was read; None while there is none."""
        line = self._heard.popleft() if self._heard else None
        if len(self._heard) < MOST_WAITING:
            self._room.set()
        return None if line is None else _decoded(line)

    async def _first_line(self, python: Path) -> Line:
        assert self._process.stdout is not None
        try:
            async with asyncio.timeout(START_S):
                line = await self._process.stdout.readline()
        except TimeoutError:
            raise RosFault(f"{python} has made no node of ROS 2 within {START_S:g} s") from None
        try:
            told: Line = json.loads(line)
        except ValueError:
            raise RosFault(f"{python} has ended before it was a node of ROS 2") from None
        if "fault" in told:
            raise RosFault(f"ROS 2: {told['fault']}")
        return told

    async def _read(self) -> None:
        assert self._process.stdout is not None
        while True:
            try:
                line = await self._process.stdout.readline()
            except ValueError:  # a line beyond the limit, which is dropped
                self._on_too_long()
                continue
            if not line:
                return
            self._heard.append(line)
            self._on_line()
            if len(self._heard) >= MOST_WAITING:
                self._room.clear()
                await self._room.wait()


def _decoded(line: bytes) -> Line:
    """A line of the process; only the standard library, which is slower, reads NaN."""
    try:
        told: Line = msgspec.json.decode(line)
    except msgspec.DecodeError:
        told = json.loads(line)
    return told


async def _told(process: Process) -> None:
    """What the process says on standard error goes into the log."""
    assert process.stderr is not None
    while True:
        try:
            line = await process.stderr.readline()
        except ValueError:
            continue
        if not line:
            return
        logger.info("ROS 2: %s", shortened(harmless(line.decode("utf-8", "backslashreplace").strip()), 500))
