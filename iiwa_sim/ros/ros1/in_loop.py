"""What rospy asks for in its threads, carried out in the event loop in turn, as the budget has time."""

import asyncio
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Generator
from concurrent.futures import Future
from typing import Any, TypeVar

import rospy

from iiwa_sim.protocols.session import ProtocolLog
from iiwa_sim.server.budget import Budget, Share

MOST_SENDERS = 1000
"""Number of publishers and callers that are told apart by name."""
RESTS = 3.0
"""Rests of rospy's threads, as a multiple of their CPU time: together they use a quarter at most."""

T = TypeVar("T")


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


class Requests:
    """Messages and calls that come by rospy, from `begin` to `end`."""

    def __init__(self, log: ProtocolLog, on_heard: Callable[[], None], budget: Budget) -> None:
        """`on_heard` is called after each; `budget` may be shared with the servers."""
        self._log = log
        self._on_heard = on_heard
        self._budget = budget
        self._waiting: set[Future[Any]] = set()  # used by the loop only
        self._senders: OrderedDict[str, _Sender] = OrderedDict()
        self._spent = _Spent()
        self.one_thread = threading.Lock()
        """Held by that thread of rospy which computes or rests: so they use one core together at most."""
        self._ended = threading.Event()
        self._loop: asyncio.AbstractEventLoop | None = None

    def begin(self, loop: asyncio.AbstractEventLoop) -> None:
        """Carry them out in this loop."""
        self._loop = loop

    @property
    def ended(self) -> bool:
        """Whether nothing is carried out any more."""
        return self._ended.is_set()

    def end(self) -> bool:
        """Carry out nothing more; says whether something was, until now."""
        ends = self._loop is not None and not self.ended
        if ends:
            self._ended.set()
        return ends

    def fail_all(self) -> None:
        """Let those fail that wait for an answer."""
        for future in list(self._waiting):  # each is notified
            settle(future, fault=rospy.ServiceException("the robot's node ends"))

    def run(self, sender: str, what: str, job: Callable[[Future[T]], Job]) -> T:
        """Run a job in the loop when it is the sender's turn; returns its result.

        Raises rospy.ServiceException when the node ends.
        """
        future: Future[T] = Future()

        def do() -> Job:
            try:
                yield from job(future)
            except Exception as fault:  # noqa: BLE001  # an internal error must not end the server
                self._log.exception("ROS", what, fault)
                settle(future, fault=rospy.ServiceException("internal error, see the log"))
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
        with self.one_thread:  # summed over all threads, so that the total is bounded
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


def settle(future: Future[Any], result: object = None, *, fault: Exception | None = None) -> None:
    """Set the result of a future, in the loop; a future that is settled, as when the node ends, stays as
    it is."""
    if future.done():
        return
    if fault is None:
        future.set_result(result)
    else:
        future.set_exception(fault)
