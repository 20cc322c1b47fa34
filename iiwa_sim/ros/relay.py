"""A node of ROS 1 or ROS 2 in a process of its own, joined by two pipes to a session of rosbridge.

The process (`relays/`) runs by an interpreter that has rospy or rclpy, of which nothing is loaded here. It is
a client of rosbridge: each line of a pipe is one message in JSON. Its first line is a `ready` or a `fault`.
"""

import asyncio
import contextlib
import json
import logging
import os
from asyncio.subprocess import PIPE, Process
from collections.abc import Callable
from pathlib import Path

import msgspec

from iiwa_sim.ros.messages import Message
from iiwa_sim.ros.outbox import Frame, Outbox, Turns
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
"""Time (s) in which the process has to end when it is asked to, before it is killed."""
AGAIN_S = 2.0
"""Time (s) after which a process that has ended by itself is started again."""
LONGEST_LINE_BYTES = 1 << 21
MOST_UNREAD_BYTES = 1 << 17
"""Bytes that the process may leave unread before messages wait in the outbox, the newest of each topic."""

logger = logging.getLogger(__name__)


class RosFault(Unusable):
    """A library or service that the ROS side needs is missing, or there can be no node. The message is one
    line."""


class Relay:
    """The process of one node, from `start` to `close`."""

    def __init__(
        self,
        name: str,
        python: Path,
        config: Message,
        lacks: str,
        open_session: Callable[[str, Outbox], RosbridgeSession],
        turns: Turns,
    ) -> None:
        """`name` is ROS 1 or ROS 2, `config` the first line that the process gets.

        `lacks` is the message if the interpreter has no library for it, with places for `python` and `fault`.
        """
        self._name, self._python, self._config, self._lacks = name, python, config, lacks
        self._open_session = open_session
        self._turns = turns
        self._watching: asyncio.Task[None] | None = None
        self._process: Process | None = None
        self._session: RosbridgeSession | None = None
        self._tasks: list[asyncio.Task[None]] = []
        self.ready: Message = {}
        """The line by which the process has told that it is a node."""

    async def start(self) -> None:
        """Be a node. Raises RosFault."""
        await self._begin()
        self._watching = asyncio.create_task(self._watch())

    async def close(self) -> None:
        """End the node and its process."""
        if self._watching is not None:
            self._watching.cancel()
            await asyncio.wait([self._watching])
            self._watching = None
        await self._end()

    async def _begin(self) -> None:
        environment = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", **os.environ}
        try:
            process = await asyncio.create_subprocess_exec(
                *(self._python, "-c", START, str(Path(__file__).parent)),
                self._name.lower().replace(" ", ""),
                stdin=PIPE,
                stdout=PIPE,
                stderr=PIPE,
                env=environment,
                limit=LONGEST_LINE_BYTES,
                start_new_session=True,  # a Ctrl-C is for us: the process ends when its input does
            )
        except OSError as fault:
            raise RosFault(f"{self._python} cannot be run: {fault.strerror}") from None
        self._process = process
        assert process.stdin is not None
        process.stdin.transport.set_write_buffer_limits(MOST_UNREAD_BYTES)
        process.stdin.write(msgspec.json.encode(self._config) + b"\n")
        self._tasks = [asyncio.create_task(self._log_errors(process))]
        try:
            ready = await self._first_line(process)
        except BaseException:
            await self._end()
            raise
        if ready != self.ready and ready["without"]:
            logger.info("%s has no types here for %s: left out", self._name, ", ".join(ready["without"]))
        self.ready, outbox = ready, Outbox()
        self._session = session = self._open_session(self._name, outbox)
        self._tasks.append(asyncio.create_task(self._read(process, session)))
        self._tasks.append(asyncio.create_task(outbox.deliver(lambda frame: self._send(process, frame))))

    async def _end(self) -> None:
        """End the process, if there is one: it ends when its input does."""
        if self._session is not None:
            self._session.end()
            self._session = None
        process, self._process = self._process, None
        if process is None:
            return
        assert process.stdin is not None
        process.stdin.close()
        try:
            async with asyncio.timeout(END_S):
                await process.wait()
        except TimeoutError:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await process.wait()
        for task in self._tasks:
            task.cancel()
        await asyncio.wait(self._tasks)

    async def _watch(self) -> None:
        """Start the process again whenever it has ended by itself."""
        name = self._name
        while True:
            if self._process is not None:
                code = await self._process.wait()
                logger.warning("the node of %s has ended with code %s: it is started again", name, code)
                await self._end()
            await asyncio.sleep(AGAIN_S)
            try:
                await self._begin()
            except RosFault as fault:
                logger.warning("%s", fault)
            else:
                logger.warning("the node of %s runs again", name)

    async def _first_line(self, process: Process) -> Message:
        assert process.stdout is not None
        try:
            async with asyncio.timeout(START_S):
                told: Message = json.loads(await process.stdout.readline())
        except TimeoutError:
            raise RosFault(f"{self._python} has made no node of {self._name} within {START_S:g} s") from None
        except ValueError:
            raise RosFault(f"{self._python} has ended before it was a node of {self._name}") from None
        if told["op"] == "lacks":
            raise RosFault(self._lacks.format(python=self._python, fault=told["msg"]))
        if told["op"] == "fault":
            raise RosFault(told["msg"])
        return told

    async def _read(self, process: Process, session: RosbridgeSession) -> None:
        assert process.stdout is not None
        while True:
            try:
                line = await process.stdout.readline()
            except ValueError:  # beyond the limit, which the process keeps
                continue
            if not line:
                return
            message: Message = json.loads(line)  # msgspec is faster, and reads no NaN
            if message["op"] == "status":
                logger.warning("%s: %s", self._name, message["msg"])
            else:
                shown = line[:1000]
                await self._turns.take(lambda m=message, s=shown: session.handle(m, s))  # type: ignore[misc]

    async def _send(self, process: Process, frame: Frame) -> None:
        assert process.stdin is not None
        process.stdin.write(f"{frame}\n".encode())
        with contextlib.suppress(ConnectionError):  # it is started again
            await process.stdin.drain()

    async def _log_errors(self, process: Process) -> None:
        """Log what the process writes to standard error."""
        assert process.stderr is not None
        while True:
            try:
                line = await process.stderr.readline()
            except ValueError:
                continue
            if not line:
                return
            text = shortened(harmless(line.decode("utf-8", "backslashreplace").strip()), 500)
            logger.info("%s: %s", self._name, text)
