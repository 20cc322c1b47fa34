"""The robot as a node of ROS 2: has a process be the node, watches it, and passes messages on.

What the process (`process.py`, `rclpy_node/`) says and hears are the messages of `Graph`: it has no truth
of its own.
"""

import asyncio
import logging
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from iiwa_sim.controller.errors import COMMUNICATION_FAILURE
from iiwa_sim.protocols.session import ProtocolLog
from iiwa_sim.ros.conventions import RosFault
from iiwa_sim.ros.graph import Graph
from iiwa_sim.ros.rmi.message_text import BadMessage
from iiwa_sim.ros.rmi.node import Message
from iiwa_sim.ros.ros2.goals import NodeGoals
from iiwa_sim.ros.ros2.process import NodeProcess
from iiwa_sim.server.budget import Budget

NAME = "iiwa_sim"
WHO = "ros2"
"""Name of the node in the log."""
ABSOLUTE = ("/clock",)
"""What is not put under the namespace: all robots of a graph have one time."""
EMPTY = "structure_needs_at_least_one_member"
"""A field that rclpy shows of messages without any."""
AGAIN_S = 2.0
"""A process that has ended by itself is started again after so long."""

logger = logging.getLogger(__name__)


class Ros2Node:
    """One robot as a node of ROS 2, from `start` to `close`."""

    def __init__(
        self,
        graph: Graph,
        python: Path,
        namespace: str,
        log: ProtocolLog,
        on_heard: Callable[[], None],
        budget: Budget,
    ) -> None:
        """`python` is an interpreter that has rclpy; `on_heard` is called after each message and call."""
        self.name = f"/{namespace.strip('/')}/{NAME}" if namespace.strip("/") else f"/{NAME}"
        """The node's full name."""
        self._graph = graph
        self._goals: NodeGoals | None = None  # of the present process, which numbers them from 1
        self._python = python
        self._namespace = namespace.strip("/")
        self._log = log
        self._on_heard = on_heard
        self._share = budget.share(self._work)
        self._process: NodeProcess | None = None
        self._watching: asyncio.Task[None] | None = None
        self._listening: dict[
            str, Callable[[], None]
        ] = {}  # topics that are published, and how that is ended
        self._without: tuple[str, ...] = ()

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
        graph = self._graph
        first = {
            "node": NAME,
            "namespace": self._namespace,
            "publish": [[_relative(topic), *kind] for topic, kind in graph.published.items()],
            "subscribe": [[_relative(topic), kind] for topic, kind in graph.subscribed.items()],
            "serve": [[_relative(name), kind] for name, kind in graph.services.items()],
            "actions": [[_relative(name), kind] for name, kind in graph.actions.items()],
        }
        process = await NodeProcess.start(self._python, first, self._share.ask_later, self._too_long)
        self._process = process
        self._goals = NodeGoals(graph.arm, process.say, process.offer, self._log, WHO)
        if process.without != self._without:
            self._without = process.without
            logger.info("ROS 2 has no types here for %s: left out", ", ".join(self._without))
        for topic in graph.published:
            if topic not in graph.recurring and _relative(topic) not in self._without:
                self._listen(topic)

    async def _end(self) -> None:
        """End the process, if there is one."""
        for end in self._listening.values():
            end()
        self._listening.clear()
        if self._goals is not None:
            self._goals.forget()
            self._goals = None
        process, self._process = self._process, None
        if process is not None:
            await process.close()

    async def _watch(self) -> None:
        """Start the process again whenever it has ended by itself."""
        while True:
            if self._process is not None:
                code = await self._process.ended()
                logger.warning("the node of ROS 2 has ended with code %s: it is started again", code)
                await self._end()
            await asyncio.sleep(AGAIN_S)
            try:
                await self._begin()
            except RosFault as fault:
                logger.warning("%s", fault)
            else:
                logger.warning("the node of ROS 2 runs again")

    def _listen(self, topic: str) -> None:
        self._listening[topic] = self._graph.listen(topic, partial(self._publish, topic))

    def _heed(self, topic: str, subscribers: int) -> None:
        """Publish what recurs as long as somebody subscribes: a robot at rest that nobody watches does not
        tick."""
        if topic in self._graph.recurring:
            if subscribers and topic not in self._listening:
                self._listen(topic)
            elif not subscribers and topic in self._listening:
                self._listening.pop(topic)()

    def _publish(self, topic: str, content: Message) -> None:
        if self._process is not None:
            tell = self._process.offer if topic in self._graph.recurring else self._process.say
            tell(topic=_relative(topic), msg=self._graph.in_ros2(topic, content))

    def _say(self, **what: Any) -> None:
        if self._process is not None:
            self._process.say(**what)

    def _too_long(self) -> None:
        self._log.refused(WHO, "a message", COMMUNICATION_FAILURE, "it is too long")

    def _work(self, until_s: float) -> bool:
        """Take what was heard, at least one message; gives whether there may be more."""
        now = asyncio.get_running_loop().time
        while self._process is not None:
            told = self._process.next()
            if told is None:
                return False
            self._take(told)
            if now() >= until_s:
                return True
        return False

    def _take(self, told: dict[str, Any]) -> None:
        if "call" in told:
            self._call(told)
        elif "subscribers" in told:
            self._heed(_rooted(told["to"]), told["subscribers"])
        elif "cancel" in told or "goal" in told:
            if self._goals is not None:
                self._goals.take(told)
        else:
            try:
                if "long" in told:
                    raise BadMessage(f"a message of {told['long']} bytes as JSON: that is too long")
                self._graph.receive(_rooted(told["topic"]), told["msg"], WHO)
            except BadMessage as fault:
                self._log.refused(WHO, told["topic"], COMMUNICATION_FAILURE, str(fault))
        self._on_heard()

    def _call(self, told: dict[str, Any]) -> None:
        number, name = told["call"], told["service"]

        try:
            if "long" in told:
                raise BadMessage(f"a request of {told['long']} bytes as JSON: that is too long")
            request = {key: value for key, value in told["request"].items() if key != EMPTY}
            self._say(answer=number, response=self._graph.call(_rooted(name), request))
        except BadMessage as fault:
            self._log.refused(WHO, name, COMMUNICATION_FAILURE, str(fault))
            self._say(answer=number, failed=str(fault))


def _relative(name: str) -> str:
    """The name as the node knows it, which its namespace is put in front of."""
    return name if name in ABSOLUTE else name.lstrip("/")


def _rooted(name: str) -> str:
    return f"/{name.lstrip('/')}"
