"""The robot as a node of ROS 2: starts the node's process, watches it, ends it, and passes messages on.

The process (`child.py`) is of another interpreter: the wheels of rclpy re-execute every interpreter of their
environment and leave their library path to its children, and a distribution's rclpy fits one Python alone. So
what is joined is two pipes, which carry the messages of `JointLevel`: the node has no truth of its own, and
nothing of rclpy is loaded here.
"""

import asyncio
import contextlib
import json
import logging
import os
from asyncio.subprocess import PIPE, Process
from collections import deque
from collections.abc import Callable
from functools import partial
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import msgspec

from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, Refused
from iiwa_sim.dialect.wire.log import DialectLog
from iiwa_sim.ros.arm.joint_level import PUBLISHED, SERVICES, SUBSCRIBED, JointLevel
from iiwa_sim.ros.arm.messages import BadGoal, in_ros2
from iiwa_sim.ros.fault import RosFault
from iiwa_sim.ros.rmi.definitions import message
from iiwa_sim.ros.rmi.node import Message, Node
from iiwa_sim.serve.budget import Budget
from iiwa_sim.wording import harmless, shortened

NAME = "iiwa_sim"
JOINT_STATES = "/joint_states"
JOINT_STATE = "sensor_msgs/JointState"
ABSOLUTE = ("/clock",)
"""What is not put under the namespace: all robots of a graph have one time."""
START_S = 30.0
"""The process has to be a node by then."""
END_S = 5.0
"""It has to have ended by then, after it was asked to."""
AGAIN_S = 2.0
"""A process that has ended by itself is started again after so long."""
MOST_UNREAD_BYTES = 1 << 20
"""Of what the process has not read: more is left out, message by message."""
LONGEST_LINE_BYTES = 1 << 21
MOST_WAITING = 16
"""Messages that have been read and not been taken; the process waits then, and the newest 10 of a topic in
it."""

logger = logging.getLogger(__name__)
_encode = msgspec.json.Encoder().encode


def _decode(line: bytes) -> dict[str, Any]:
    """A line of the process; only the standard library, which is slower, reads NaN."""
    try:
        told: dict[str, Any] = msgspec.json.decode(line)
    except msgspec.DecodeError:
        told = json.loads(line)
    return told


class Ros2Node:
    """The joint level of one robot as a node of ROS 2, from `start` to `close`."""

    def __init__(
        self,
        node: Node,
        arm: JointLevel,
        python: Path,
        namespace: str,
        log: DialectLog,
        on_heard: Callable[[], None],
        budget: Budget,
    ) -> None:
        """`python` is an interpreter that has rclpy; `on_heard` is called after each message and call."""
        self.name = f"/{namespace.strip('/')}/{NAME}" if namespace.strip("/") else f"/{NAME}"
        """The node's full name."""
        self._node = node
        self._arm = arm
        self._python = python
        self._namespace = namespace.strip("/")
        self._log = log
        self._on_heard = on_heard
        self._share = budget.share(self._work)
        self._heard: deque[bytes] = deque()
        self._room = asyncio.Event()
        self._process: Process | None = None
        self._watching: asyncio.Task[None] | None = None
        self._reading: list[asyncio.Task[None]] = []  # what one process writes
        self._ended: list[Callable[[], None]] = []  # how what was begun for a process is ended
        self._without: list[str] = []

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
        self._share.leave()
        await self._end()

    async def _begin(self) -> None:
        environment = dict(os.environ)
        environment.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        with as_file(files("iiwa_sim.ros.ros2").joinpath("child.py")) as child:
            try:
                self._process = process = await asyncio.create_subprocess_exec(
                    *(self._python, child),
                    stdin=PIPE,
                    stdout=PIPE,
                    stderr=PIPE,
                    env=environment,
                    limit=LONGEST_LINE_BYTES,
                    start_new_session=True,  # a Ctrl-C is for us: the process ends when its input does
                )
            except OSError as fault:
                raise RosFault(f"{self._python} cannot be run: {fault.strerror}") from None
        self._reading.append(asyncio.create_task(_told(process)))
        self._say(
            node=NAME,
            namespace=self._namespace,
            publish=[
                [_relative(JOINT_STATES), "sensor_msgs/msg/JointState", False],
                *([_relative(topic), kind, rate_hz == 0] for topic, (kind, rate_hz) in PUBLISHED.items()),
            ],
            subscribe=[[_relative(topic), kind] for topic, kind in SUBSCRIBED.items()],
            serve=[[_relative(service), kind] for service, kind in SERVICES.items()],
        )
        try:
            told = await self._first_line(process)
        except BaseException:
            await self._end()
            raise
        if told["ready"] != self._without:
            self._without = told["ready"]
            logger.info("ROS 2 has no types here for %s: left out", ", ".join(self._without))
        self._room.set()
        self._reading.append(asyncio.create_task(self._read(process)))
        self._listen()

    async def _first_line(self, process: Process) -> dict[str, Any]:
        assert process.stdout is not None
        try:
            async with asyncio.timeout(START_S):
                line = await process.stdout.readline()
        except TimeoutError:
            raise RosFault(f"{self._python} has made no node of ROS 2 within {START_S:g} s") from None
        try:
            told: dict[str, Any] = json.loads(line)
        except ValueError:
            raise RosFault(f"{self._python} has ended before it was a node of ROS 2") from None
        if "fault" in told:
            raise RosFault(f"ROS 2: {told['fault']}")
        return told

    async def _end(self) -> None:
        """End the process, if there is one."""
        for end in self._ended:
            end()
        self._ended.clear()
        self._heard.clear()
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
        for task in self._reading:
            task.cancel()
        if self._reading:
            await asyncio.wait(self._reading)
        self._reading.clear()

    async def _watch(self) -> None:
        """Start the process again whenever it has ended by itself."""
        while True:
            process = self._process
            if process is not None:
                code = await process.wait()
                logger.warning("the node of ROS 2 has ended with code %s: it is started again", code)
                await self._end()
            await asyncio.sleep(AGAIN_S)
            try:
                await self._begin()
            except RosFault as fault:
                logger.warning("%s", fault)
            else:
                logger.warning("the node of ROS 2 is there again")

    def _listen(self) -> None:
        definition = message(JOINT_STATE)

        def hear_joints(content: Message) -> None:
            self._publish(JOINT_STATES, in_ros2(definition, content))

        self._node.listen(JOINT_STATES, hear_joints)
        self._ended.append(partial(self._node.unlisten, JOINT_STATES, hear_joints))
        for topic in PUBLISHED:
            if _relative(topic) not in self._without:
                hear = partial(self._publish, topic)
                self._arm.listen(topic, hear)
                self._ended.append(partial(self._arm.unlisten, topic, hear))
        self._on_heard()  # from now on ticks are wanted

    def _publish(self, topic: str, content: Message) -> None:
        self._say(topic=_relative(topic), msg=content)

    def _say(self, **what: Any) -> None:
        process = self._process
        if process is None or process.stdin is None or process.stdin.is_closing():
            return
        if process.stdin.transport.get_write_buffer_size() < MOST_UNREAD_BYTES:
            process.stdin.write(_encode(what) + b"\n")

    async def _read(self, process: Process) -> None:
        assert process.stdout is not None
        while True:
            try:
                line = await process.stdout.readline()
            except ValueError:  # a line beyond the limit, which is dropped
                self._log.refused("ros2", "a message", COMMUNICATION_FAILURE, "it is too long")
                continue
            if not line:
                return
            self._heard.append(line)
            self._share.ask_later()
            if len(self._heard) >= MOST_WAITING:
                self._room.clear()
                await self._room.wait()

    def _work(self, until_s: float) -> bool:
        """Take what was heard, at least one message."""
        now = asyncio.get_running_loop().time
        while self._heard:
            self._take(_decode(self._heard.popleft()))
            if now() >= until_s:
                break
        if len(self._heard) < MOST_WAITING:
            self._room.set()
        return bool(self._heard)

    def _take(self, told: dict[str, Any]) -> None:
        who = "ros2"
        if "call" in told:
            name = f"/{told['service'].lstrip('/')}"
            try:
                response = self._arm.call(name, {} if "data" not in told["request"] else told["request"])
            except BadGoal as fault:
                response = {"success": False, "message": str(fault)}
            self._say(answer=told["call"], response=response)
        else:
            reason = self._refusal_of(told, who)
            if reason is not None:
                self._log.refused(who, told["topic"], COMMUNICATION_FAILURE, reason)
        self._on_heard()

    def _refusal_of(self, told: dict[str, Any], who: str) -> str | None:
        """Take a message; gives why it is refused, None where it is not."""
        if "long" in told:
            return f"a message of {told['long']} bytes as JSON: that is too long"
        try:
            self._arm.receive(f"/{told['topic'].lstrip('/')}", told["msg"], who)
        except BadGoal as fault:
            return str(fault)
        except Refused as refused:
            return refused.reason
        return None


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


def _relative(name: str) -> str:
    """The name as the node knows it, which its namespace is put in front of."""
    return name if name in ABSOLUTE else name.lstrip("/")
