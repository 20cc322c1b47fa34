"""A node of ROS 1 or ROS 2 in a process of its own, joined by two pipes to a session of rosbridge.

The process (`relays/`) runs by an interpreter that has rospy or rclpy, of which nothing is loaded here. It is
a client of rosbridge: each line of a pipe is one message in JSON. Its first line is a `ready` or a `fault`.
"""

import asyncio
import contextlib
import json
import logging
import os
from asyncio.subprocess import PIPE
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from iiwa_sim.ros.messages import Message
from iiwa_sim.ros.outbox import Outbox, Turns
from iiwa_sim.ros.rosbridge_session import RosbridgeSession
from iiwa_sim.wording import Unusable, harmless, shortened

START = """
import sys
sys.path = [*sys.path[1:], sys.argv[1]]  # behind others: its modules must not hide those of ROS
from relays import pipe
pipe.run(sys.argv[2])
"""
"""The process's program, with the folder of `relays` and the name of one as its arguments."""
START_S = 120.0
"""Time (s) after its start in which the process has to become a node."""
END_S = 10.0
"""Time (s) in which the process has to end on request, before it is killed."""
LONGEST_LINE_BYTES = 1 << 28
MOST_UNREAD_BYTES = 1 << 17
"""Bytes that the process may leave unread before messages wait in the outbox, the newest of each topic."""

logger = logging.getLogger(__name__)


class RosFault(Unusable):
    """The ROS side lacks a library or a service, or there can be no node. The message is one line."""


class Relay:
    """The process of one node, from `start` to `close`."""

    def __init__(
        self,
        name: str,
        python: Path,
        config: Message,
        open_session: Callable[[str, Outbox], RosbridgeSession],
        turns: Turns,
    ) -> None:
        """`name` is ROS 1 or ROS 2, `config` the first line that the process gets."""
        self._name, self._python, self._config = name, python, config
        self._open_session = open_session
        self._turns = turns
        self._process: Any = None  # an asyncio.subprocess.Process with pipes
        self._tasks: list[asyncio.Task[None]] = []
        self.node = ""
        """The name of the node of ROS 2, or the URI of the master of ROS 1."""

    async def start(self) -> None:
        """Be a node. Raises RosFault."""
        try:
            process: Any = await asyncio.create_subprocess_exec(
                *(self._python, "-c", START, str(Path(__file__).parent)),
                self._name.lower().replace(" ", ""),
                stdin=PIPE,
                stdout=PIPE,
                stderr=PIPE,
                env={"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", **os.environ},
                limit=LONGEST_LINE_BYTES,
                start_new_session=True,  # a Ctrl-C is for us: the process ends when its input does
            )
        except OSError as fault:
            raise RosFault(f"{self._python} cannot be run: {fault.strerror}") from None
        self._process = process
        process.stdin.transport.set_write_buffer_limits(MOST_UNREAD_BYTES)
        process.stdin.write(msgspec.json.encode(self._config) + b"\n")
        self._tasks.append(asyncio.create_task(self._log(process.stderr)))
        try:
            async with asyncio.timeout(START_S):
                ready = json.loads(await process.stdout.readline())
        except (TimeoutError, ValueError):  # it has ended
            raise RosFault(f"{self._python} has made no node of {self._name} within {START_S:g} s") from None
        if ready["op"] == "fault":
            raise RosFault(ready["msg"])
        self.node = ready["node"]
        outbox = Outbox()
        session = self._open_session(self._name, outbox)
        self._tasks.append(asyncio.create_task(self._read(process.stdout, session)))
        self._tasks.append(asyncio.create_task(outbox.deliver(partial(_send, process.stdin))))

    async def close(self) -> None:
        """End the node and its process."""
        if self._process is None:
            return
        for task in self._tasks[1:]:  # the first one logs until the end
            task.cancel()
        self._process.stdin.close()
        try:
            async with asyncio.timeout(END_S):
                await self._process.wait()
        except TimeoutError:
            self._process.kill()
            await self._process.wait()
        await asyncio.wait(self._tasks, timeout=END_S)

    async def _read(self, stdout: asyncio.StreamReader, session: RosbridgeSession) -> None:
        try:
            async for line in stdout:  # msgspec is faster than json, and reads no NaN
                await self._turns.take(partial(session.receive, line, json.loads))
            logger.error("the node of %s has ended by itself", self._name)
        finally:
            session.end()

    async def _log(self, stderr: asyncio.StreamReader) -> None:
        async for line in stderr:
            text = shortened(harmless(line.decode("utf-8", "backslashreplace").strip()), 500)
            logger.info("%s: %s", self._name, text)


async def _send(stdin: asyncio.StreamWriter, frame: str) -> None:
    stdin.write(f"{frame}\n".encode())
    with contextlib.suppress(ConnectionError):  # the process has ended
        await stdin.drain()
