"""A node of ROS 1 beside the server: rospy's threads on one side, the event loop on the other. Needs
rospy."""

import asyncio
import contextlib
import logging
import sys
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Generator
from concurrent.futures import Future
from functools import partial
from typing import Any, TypeVar

import rosgraph
import rospy

from iiwa_sim.controller.errors import EXECUTION
from iiwa_sim.dialect.wire.log import DialectLog
from iiwa_sim.ros.rmi.definitions import Definition, service
from iiwa_sim.ros.rmi.node import PUBLISHED, SUBSCRIBED, BadMessage, Message, Node
from iiwa_sim.ros.rmi.serialized import NoSuchMessage, deserialized
from iiwa_sim.ros.ros1.master import MasterWatch, start_node
from iiwa_sim.ros.ros1.service import READ_BYTES, Service
from iiwa_sim.ros.ros1.types import Types
from iiwa_sim.serve.budget import Budget, Share
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
MOST_SENDERS = 1000
"""Number of publishers and callers that are told apart by name."""
RESTS = 3.0
"""Rests of rospy's threads, as a multiple of their CPU time: together they use a quarter at most."""
SWITCH_S = 0.0005
"""Seconds that a thread of rospy may keep the interpreter while the loop waits for it."""

logger = logging.getLogger(__name__)

T = TypeVar("T")


class NodeFault(Exception):
    """There can be no node. The message is one line."""


class _Spent(threading.local):
    """CPU time used by a thread of rospy, which has one for each publisher and caller."""

    counted_s = 0.0

    def since_asked(self) -> float:
        now_s = time.thread_time()
        spent_s, self.counted_s = now_s - self.counted_s, now_s
        return spent_s


Job = Generator[None, None, None]
"""Work for the loop, in steps."""


class _Sender:
    """A publisher or caller, whose requests are carried out in the loop one after the other."""

    def __init__(self, budget: Budget) -> None:
        self._share: Share = budget.share(self._work)
        self._jobs: deque[Job] = deque()

    def ask(self, job: Job, spent_s: float) -> None:
        """Queue a job; `spent_s` is CPU time used elsewhere on its message."""
        self._jobs.append(job)
        self._share.charge(spent_s)
        self._share.ask()

    def _work(self, until_s: float) -> bool:
        while self._jobs and time.monotonic() < until_s:
            try:
                next(self._jobs[0])
            except StopIteration:
                self._jobs.popleft()
        return bool(self._jobs)


class Ros1Node:
    """The topics and services of a `Node` at the ROS master of the environment, from `start` to `close`.

    rospy has one node per process: if there is one already, topics and services become part of it.
    """

    def __init__(self, node: Node, log: DialectLog, on_heard: Callable[[], None], budget: Budget) -> None:
        """`on_heard` is called after each message and call; `budget` may be shared with the servers."""
        self._node = node
        self._log = log
        self._on_heard = on_heard
        topics = [*(kind for kind, _ in PUBLISHED.values()), *SUBSCRIBED.values()]
        self._types = Types(map(node.definition, topics), node.services.values())
        self._listeners: dict[str, Callable[[Message], None]] = {}
        self._handles: list[Any] = []  # rospy's publishers, services and subscribers
        self._waiting: set[Future[Any]] = set()  # jobs of rospy's threads; used by the loop only
        self._budget = budget
        self._senders: OrderedDict[str, _Sender] = OrderedDict()
        self._spent = _Spent()
        self._one_thread = threading.Lock()
        self._switch_s = sys.getswitchinterval()
        self._ended = threading.Event()
        self._watch: MasterWatch | None = None
        self._own = False
        self._loop: asyncio.AbstractEventLoop | None = None

    @property
    def master(self) -> str:
        """URI of the master (ROS_MASTER_URI)."""
        return str(rosgraph.get_master_uri(argv=[])).rstrip("/")

    async def start(self) -> None:
        """Register the node. Raises NodeFault."""
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
        sys.setswitchinterval(min(self._switch_s, SWITCH_S))
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
        """Unregister at the master; pending calls fail."""
        if self._loop is None or self._ended.is_set():
            return
        self._ended.set()
        sys.setswitchinterval(self._switch_s)
        for topic, listener in self._listeners.items():
            self._node.unlisten(topic, listener)
        for future in list(self._waiting):  # each is notified
            _settle(future, fault=rospy.ServiceException("the robot's node ends"))
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
        if not self._ended.is_set():
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
            _settle(done, None)

        with contextlib.suppress(rospy.ServiceException):  # the node ends
            self._in_loop(sender, topic, receive)

    def _called(self, name: str, kind: str, request: Any) -> Any:
        """Called by rospy, in a thread of its own, with a service request. A rospy.ServiceException
        reaches the caller."""
        definition = service(kind)

        def call(answered: Future[Message]) -> Job:
            def fail(reason: str) -> None:
                _settle(answered, fault=rospy.ServiceException(reason))

            def answer(response: Message) -> None:
                _settle(answered, response)

            try:
                content = yield from _content(definition.request, request.data)
                self._node.call(name, content, answer, fail)
            except BadMessage as fault:
                fail(str(fault))

        response = self._in_loop(_sender_of(request), name, call)
        with self._one_thread:
            return self._types.filled(definition.response, response)

    def _in_loop(self, sender: str, what: str, job: Callable[[Future[T]], Job]) -> T:
        """Run a job in the loop when it is the sender's turn; returns its result.

        Raises rospy.ServiceException when the node ends.
        """
        future: Future[T] = Future()

        def do() -> Job:
            try:
                yield from job(future)
            except Exception as fault:  # noqa: BLE001  # an internal error must not end the server
                self._log.exception("ROS", what, fault)
                _settle(future, fault=rospy.ServiceException("internal fault, told in the log"))
            finally:
                self._on_heard()

        def ask(spent_s: float) -> None:
            if self._ended.is_set():
                future.set_exception(rospy.ServiceException("the robot's node ends"))
                return
            self._waiting.add(future)
            future.add_done_callback(self._waiting.discard)
            self._sender(sender).ask(do(), spent_s)

        spent_s = self._spent.since_asked()
        with self._one_thread:  # summed over all threads, so that the total is bounded
            self._ended.wait(spent_s * RESTS)
        assert self._loop is not None
        try:
            self._loop.call_soon_threadsafe(ask, spent_s)
        except RuntimeError:  # the node is closed
            raise rospy.ServiceException("the robot's node has ended") from None
        return future.result()

    def _sender(self, name: str) -> _Sender:
        """The sender of this name. The most recent ones are kept; a forgotten one starts afresh."""
        if name not in self._senders:
            self._senders[name] = _Sender(self._budget)
            if len(self._senders) > MOST_SENDERS:
                self._senders.popitem(last=False)
        self._senders.move_to_end(name)
        return self._senders[name]


def _settle(future: Future[Any], result: object = None, *, fault: Exception | None = None) -> None:
    """Set the result of a future, in the loop; a future that is settled, as when the node ends, stays as
    it is."""
    if future.done():
        return
    if fault is None:
        future.set_result(result)
    else:
        future.set_exception(fault)


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
