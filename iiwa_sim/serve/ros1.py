"""A node of ROS 1 beside the server: rospy's threads on one side, the loop on the other. Needs rospy."""

import asyncio
import contextlib
import logging
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
from typing import Any, TypeVar

import rosgraph
import rospy

from iiwa_sim.controller.errors import EXECUTION
from iiwa_sim.dialect.log import DialectLog
from iiwa_sim.dialect.rmi.definitions import message, service
from iiwa_sim.dialect.rmi.node import PUBLISHED, SUBSCRIBED, BadMessage, Message, Node
from iiwa_sim.serve.allowance import Allowance, Allowances
from iiwa_sim.serve.ros1_master import MasterWatch, start_node
from iiwa_sim.serve.ros1_types import Types, told
from iiwa_sim.wording import harmless, shortened

NODE_NAME = "iiwa_sim"
STATES_WAIT = 10
"""Of a topic, for a subscriber that is slow: the newest are kept."""
RESULTS_WAIT = 1000
MASTER_S = 5.0
"""For the master to answer."""
STARTING_S = 30.0
ENDING_S = 5.0

logger = logging.getLogger(__name__)

T = TypeVar("T")


class NodeFault(Exception):
    """There can be no node. The message is one line."""


class _Publisher(threading.local):
    """Who publishes: rospy hears each in a thread of its own."""

    def __init__(self) -> None:
        self.allowance = Allowance()


class _Caller(threading.local):
    """Who calls a service: rospy hears each connection in a thread of its own."""

    counted_s = 0.0
    """Of the thread's time."""


class Ros1Node:
    """Topics and services of a `Node` on the ROS master that the environment names, from `start` to `close`.

    rospy has one node per process: if the process has one already, topics and services become part of it.
    """

    def __init__(self, node: Node, log: DialectLog, on_heard: Callable[[], None]) -> None:
        """`on_heard` is called after every message and every call."""
        self._node = node
        self._log = log
        self._on_heard = on_heard
        topics = [*(kind for kind, _ in PUBLISHED.values()), *SUBSCRIBED.values()]
        self._types = Types(map(node.definition, topics), node.services.values())
        self._listeners: dict[str, Callable[[Message], None]] = {}
        self._handles: list[Any] = []  # of rospy: publishers, services, subscribers
        self._waiting: set[Future[Any]] = set()  # of rospy's threads for the loop, which alone uses this
        self._publisher = _Publisher()
        self._caller = _Caller()
        self._callers = Allowances()
        self._ended = threading.Event()
        self._watch: MasterWatch | None = None
        self._own = False
        self._loop: asyncio.AbstractEventLoop | None = None

    @property
    def master(self) -> str:
        """Where the master is (ROS_MASTER_URI)."""
        return str(rosgraph.get_master_uri(argv=[])).rstrip("/")

    async def start(self) -> None:
        """Be there. Raises NodeFault."""
        self._loop = asyncio.get_running_loop()
        if rospy.is_shutdown():
            raise NodeFault("the ROS node of this process has ended, and rospy starts no second one")
        try:
            online = await _beside(lambda: rosgraph.is_master_online(self.master), MASTER_S)
        except (TimeoutError, OSError, ValueError):
            online = False
        if not online:
            raise NodeFault(
                f"no ROS master at {shortened(harmless(self.master), 80)}: start one (roscore, or rosmaster "
                "--core), or set ROS_MASTER_URI"
            )
        self._own = not rospy.core.is_initialized()
        try:
            await _beside(self._open, STARTING_S)
        except (TimeoutError, OSError, rospy.ROSException, ValueError) as fault:
            self._listeners = {}
            await self.close()
            said = shortened(harmless(str(fault) or "it does not answer"), 200)
            raise NodeFault(f"no ROS node with the master at {self.master}: {said}") from None
        for topic, listener in self._listeners.items():
            self._node.listen(topic, listener)
        self._watch = MasterWatch(self._handles)

    async def close(self) -> None:
        """Take leave of the master; calls that wait fail."""
        if self._loop is None or self._ended.is_set():
            return
        self._ended.set()
        for topic, listener in self._listeners.items():
            self._node.unlisten(topic, listener)
        for future in self._waiting:
            if not future.done():
                future.set_exception(rospy.ServiceException("the robot's node ends"))
        try:
            await _beside(self._take_leave, ENDING_S)
        except TimeoutError:
            logger.warning("the ROS master does not answer: it still has this node on its list")

    def _open(self) -> None:
        """In a thread, since the master may take its time."""
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
            self._handles.append(rospy.Service(name, self._types.services[kind], called))
        for topic, kind in SUBSCRIBED.items():
            heard = partial(self._heard, topic, kind)
            self._handles.append(rospy.Subscriber(topic, self._types.heard(kind), heard, tcp_nodelay=True))

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
        if not self._ended.is_set():
            logger.warning("the ROS node was shut down from outside: its topics and services are gone")

    def _publish(self, publisher: Any, kind: str, content: Message) -> None:
        if publisher.get_num_connections() == 0:
            return
        try:
            publisher.publish(self._types.filled(message(kind), content))
        except rospy.ROSException as fault:  # while the node is being shut down
            logger.debug("not published: %s", fault)

    def _heard(self, topic: str, kind: str, received: Any) -> None:
        """A message has come, in a thread of its publisher: this takes no other before it returns."""
        begun_s = time.thread_time()
        sender = harmless(str(received._connection_header.get("callerid", "?")))
        content = None if received.fault else told(message(kind), received)
        took_s = time.thread_time() - begun_s

        def receive(done: Future[float]) -> None:
            begun_s = time.thread_time()
            try:
                if content is None:
                    raise BadMessage(received.fault)
                self._node.receive(topic, content)
            except BadMessage as fault:
                self._log.refused(f"{sender} (ROS)", topic, EXECUTION, str(fault))
            done.set_result(took_s + time.thread_time() - begun_s)

        try:
            took_s = self._in_loop(topic, receive)
        except rospy.ServiceException:  # the node ends
            return
        if (rest_s := self._publisher.allowance.rest_s(took_s, time.monotonic())) > 0.0:
            self._ended.wait(rest_s)

    def _called(self, name: str, kind: str, request: Any) -> Any:
        """A service is called, in a thread of its own. rospy.ServiceException tells the caller."""
        took_s = 0.0  # in the loop

        def call(answered: Future[Message]) -> None:
            begun_s: float | None = time.thread_time()

            def end(tell: Callable[[], None]) -> None:
                nonlocal took_s
                if begun_s is not None:  # else it has taken its time, but not ours
                    took_s = time.thread_time() - begun_s
                if not answered.done():
                    tell()

            def fail(reason: str) -> None:
                end(lambda: answered.set_exception(rospy.ServiceException(reason)))

            def answer(response: Message) -> None:
                end(lambda: answered.set_result(response))

            try:
                self._node.call(name, content, answer, fail)
            except BadMessage as fault:
                fail(str(fault))
            begun_s = None

        definition = service(kind)
        try:
            if request.fault:
                raise rospy.ServiceException(request.fault)
            content = told(definition.request, request)
            return self._types.filled(definition.response, self._in_loop(name, call))
        finally:
            self._rest(str(request._connection_header.get("callerid", "?")), took_s)

    def _rest(self, caller: str, in_loop_s: float) -> None:
        """Listen to others for a while, where a caller has taken much time, in the loop and here."""
        now_s = time.thread_time()
        took_s = in_loop_s + now_s - self._caller.counted_s
        self._caller.counted_s = now_s
        if (rest_s := self._callers.rest_s(caller, took_s, time.monotonic())) > 0.0:
            self._ended.wait(rest_s)

    def _in_loop(self, what: str, function: Callable[[Future[T]], None]) -> T:
        """What `function`, called in the loop, sets. Raises rospy.ServiceException when the node ends."""
        future: Future[T] = Future()

        def run() -> None:
            if self._ended.is_set():
                future.set_exception(rospy.ServiceException("the robot's node ends"))
                return
            self._waiting.add(future)
            future.add_done_callback(self._waiting.discard)
            try:
                function(future)
            except Exception as fault:  # noqa: BLE001  # the server goes on
                self._log.exception("ROS", what, fault)
                future.set_exception(rospy.ServiceException("internal fault, told in the log"))
            finally:
                self._on_heard()

        assert self._loop is not None
        try:
            self._loop.call_soon_threadsafe(run)
        except RuntimeError:  # it is closed
            raise rospy.ServiceException("the robot's node has ended") from None
        return future.result()


async def _beside(function: Callable[[], T], limit_s: float) -> T:
    """What `function` gives or raises, called in a thread that nobody waits for any longer than this.

    Raises TimeoutError.
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
        except Exception as fault:  # noqa: BLE001  # handed on
            outcome = partial(future.set_exception, fault)
        with contextlib.suppress(RuntimeError):  # nobody waits any more, and the loop is closed
            loop.call_soon_threadsafe(settle, outcome)

    threading.Thread(target=run, name="ros-master", daemon=True).start()
    async with asyncio.timeout(limit_s):
        return await future
