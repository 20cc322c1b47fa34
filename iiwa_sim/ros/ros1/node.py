"""A node of ROS 1 beside the server: rospy's threads on one side, the event loop on the other. Needs
rospy."""

import asyncio
import contextlib
import logging
import sys
import threading
from collections.abc import Callable, Generator
from concurrent.futures import Future
from functools import partial
from typing import Any, TypeVar

import rosgraph
import rospy

from iiwa_sim.controller.errors import EXECUTION
from iiwa_sim.protocols.session import ProtocolLog
from iiwa_sim.ros.conventions import RosFault
from iiwa_sim.ros.rmi.definitions import service
from iiwa_sim.ros.rmi.message_text import BadMessage, Definition
from iiwa_sim.ros.rmi.node import PUBLISHED, SUBSCRIBED, Message, Node
from iiwa_sim.ros.rmi.serialized import NoSuchMessage, deserialized
from iiwa_sim.ros.ros1.in_loop import Job, Requests, settle
from iiwa_sim.ros.ros1.master import MasterWatch, start_node
from iiwa_sim.ros.ros1.service import READ_BYTES, Service
from iiwa_sim.ros.ros1.types import Types
from iiwa_sim.server.budget import Budget
from iiwa_sim.wording import harmless, shortened

NODE_NAME = "iiwa_sim"
STATES_WAIT = 10
"""Messages of a topic kept for a slow subscriber: the newest."""
RESULTS_WAIT = 1000
MASTER_S = 5.0
"""Seconds for the master to answer."""
STARTING_S = 30.0
ENDING_S = 5.0
LONGEST_MESSAGE_BYTES = 262_144
"""Longer messages are not parsed; about a hundred commands fit in."""
SWITCH_S = 0.0005
"""Seconds that a thread of rospy may keep the interpreter while the loop waits for it."""

logger = logging.getLogger(__name__)

T = TypeVar("T")


class Ros1Node:
    """The topics and services of a `Node` at the ROS master of the environment, from `start` to `close`.

    rospy has one node per process: if there is one already, topics and services become part of it.
    """

    def __init__(self, node: Node, log: ProtocolLog, on_heard: Callable[[], None], budget: Budget) -> None:
        """`on_heard` is called after each message and call; `budget` may be shared with the servers."""
        self._node = node
        self._log = log
        topics = [*(kind for kind, _ in PUBLISHED.values()), *SUBSCRIBED.values()]
        self._types = Types(map(node.definition, topics), node.services.values())
        self._listeners: dict[str, Callable[[Message], None]] = {}
        self._handles: list[Any] = []  # rospy's publishers, services and subscribers
        self._requests = Requests(log, on_heard, budget)
        self._switch_s = sys.getswitchinterval()
        self._watch: MasterWatch | None = None
        self._own = False

    @property
    def master(self) -> str:
        """URI of the master (ROS_MASTER_URI)."""
        return str(rosgraph.get_master_uri(argv=[])).rstrip("/")

    async def start(self) -> None:
        """Register the node. Raises RosFault."""
        self._requests.begin(asyncio.get_running_loop())
        if rospy.is_shutdown():
            raise RosFault("the ROS node of this process has ended, and rospy starts no second one")
        try:
            online = await _beside(lambda: rosgraph.is_master_online(self.master), MASTER_S)
        except (TimeoutError, OSError, ValueError):
            online = False
        if not online:
            raise RosFault(
                f"no ROS master at {shortened(harmless(self.master), 80)}: start one (roscore, or rosmaster "
                "--core), or set ROS_MASTER_URI"
            )
        self._own = not rospy.core.is_initialized()
        sys.setswitchinterval(min(self._switch_s, SWITCH_S))
        try:
            await _beside(self._open, STARTING_S)
        except (TimeoutError, OSError, rospy.ROSException, ValueError) as fault:
            self._listeners = {}
            await self.close()
            said = shortened(harmless(str(fault) or "it does not answer"), 200)
            raise RosFault(f"no ROS node with the master at {self.master}: {said}") from None
        for topic, listener in self._listeners.items():
            self._node.listen(topic, listener)
        self._watch = MasterWatch(self._handles)

    async def close(self) -> None:
        """Unregister at the master; pending calls fail."""
        if not self._requests.end():
            return
        sys.setswitchinterval(self._switch_s)
        for topic, listener in self._listeners.items():
            self._node.unlisten(topic, listener)
        self._requests.fail_all()
        try:
            await _beside(self._take_leave, ENDING_S)
        except TimeoutError:
            logger.warning("the ROS master does not answer: it still has this node on its list")

    def _open(self) -> None:
        """Register; runs in a thread, since the master may be slow."""
        if self._own:
            start_node(NODE_NAME)
        rospy.on_shutdown(self._shut_down)
        for topic, (kind, rate_hz) in PUBLISHED.items():
            publisher = rospy.Publisher(
                topic,
                self._types.message(kind),
                tcp_nodelay=True,
                queue_size=STATES_WAIT if rate_hz else RESULTS_WAIT,
            )
            self._handles.append(publisher)
            self._listeners[topic] = partial(self._publish, publisher, kind)
        for name, kind in self._node.services.items():
            called = partial(self._called, name, kind)
            self._handles.append(Service(name, self._types.services[kind], called))
        for topic, kind in SUBSCRIBED.items():
            heard = partial(self._heard, topic, kind)
            self._handles.append(
                rospy.Subscriber(
                    topic, self._types.heard(kind), heard, buff_size=READ_BYTES, tcp_nodelay=True
                )
            )

    def _take_leave(self) -> None:
        if self._watch is not None:
            self._watch.end()
        if self._own:
            rospy.signal_shutdown("the robot ends")
            return
        for handle in self._handles:
            if isinstance(handle, rospy.Service):
                handle.shutdown("the robot ends")
            else:
                handle.unregister()

    def _shut_down(self) -> None:
        if not self._requests.ended:
            logger.warning("the ROS node was shut down from outside: its topics and services are gone")

    def _publish(self, publisher: Any, kind: str, content: Message) -> None:
        if publisher.get_num_connections() == 0:
            return
        try:
            publisher.publish(self._types.filled(self._node.definition(kind), content))
        except rospy.ROSException as fault:  # while the node is being shut down
            logger.debug("not published: %s", fault)

    def _heard(self, topic: str, kind: str, received: Any) -> None:
        """Called by rospy, in the thread of a publisher, with a message; blocks that publisher until it is
        handled."""
        sender = _sender_of(received)

        def receive(done: Future[None]) -> Job:
            try:
                content = yield from _content(self._node.definition(kind), received.data)
                self._node.receive(topic, content)
            except BadMessage as fault:
                self._log.refused(f"{sender} (ROS)", topic, EXECUTION, str(fault))
            settle(done, None)

        with contextlib.suppress(rospy.ServiceException):  # the node ends
            self._requests.run(sender, topic, receive)

    def _called(self, name: str, kind: str, request: Any) -> Any:
        """Called by rospy, in a thread of its own, with a service request. A rospy.ServiceException
        reaches the caller."""
        definition = service(kind)

        def call(answered: Future[Message]) -> Job:
            try:
                content = yield from _content(definition.request, request.data)
                settle(answered, self._node.call(name, content))
            except BadMessage as fault:
                settle(answered, fault=rospy.ServiceException(str(fault)))

        response = self._requests.run(_sender_of(request), name, call)
        with self._requests.one_thread:
            return self._types.filled(definition.response, response)


def _content(definition: Definition, data: bytes) -> Generator[None, None, Message]:
    """Parse a message, in steps. Raises BadMessage."""
    if len(data) > LONGEST_MESSAGE_BYTES:
        raise BadMessage(f"a message of {len(data)} bytes: expected up to {LONGEST_MESSAGE_BYTES}")
    try:
        return (yield from deserialized(definition, data))
    except NoSuchMessage:
        raise BadMessage(f"what came is no {definition.name}") from None


def _sender_of(received: Any) -> str:
    return harmless(str(received._connection_header.get("callerid", "?")))


async def _beside(function: Callable[[], T], limit_s: float) -> T:
    """Call a function in a thread of its own and wait for its result, for `limit_s` at most.

    Raises TimeoutError, and what the function raises.
    """
    loop = asyncio.get_running_loop()
    future: asyncio.Future[T] = loop.create_future()

    def settle(outcome: Callable[[], None]) -> None:
        if not future.done():
            outcome()

    def run() -> None:
        outcome: Callable[[], None]
        try:
            outcome = partial(future.set_result, function())
        except Exception as fault:  # noqa: BLE001  # passed on
            outcome = partial(future.set_exception, fault)
        with contextlib.suppress(RuntimeError):  # nobody waits any more: the loop is closed
            loop.call_soon_threadsafe(settle, outcome)

    threading.Thread(target=run, name="ros-master", daemon=True).start()
    async with asyncio.timeout(limit_s):
        return await future
