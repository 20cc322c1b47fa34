"""Traffic of rosbridge: frames that wait for a client, and whose message is handled next.

The frames are bounded however slowly a client reads.
"""

import asyncio
import contextlib
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field

from iiwa_sim.clock.clock import Clock

LONGEST_FEED = 1000


@dataclass
class _Feed:
    """The messages of one topic, each made when it is sent."""

    throttle_s: float = 0.0
    waiting: deque[Callable[[], str]] = field(default_factory=deque)
    due_s: float = 0.0


class Outbox:
    """Replies are sent in order, before messages of topics. Times are of one clock, in s."""

    def __init__(self) -> None:
        self.replies: deque[str] = deque()
        self._news = asyncio.Event()
        self._feeds: dict[str, _Feed] = {}

    def reply(self, message: str) -> None:
        """Queue a message that must not be lost."""
        self.replies.append(message)
        self._news.set()

    def set_feed(self, topic: str, throttle_s: float, queue_length: float) -> None:
        """Send messages of a topic at least `throttle_s` apart, and keep the newest `queue_length`."""
        feed = self._feeds.setdefault(topic, _Feed())
        feed.throttle_s = throttle_s
        feed.waiting = deque(feed.waiting, maxlen=int(min(max(queue_length, 1), LONGEST_FEED)))

    def end_feed(self, topic: str) -> None:
        """Drop the waiting messages of a topic."""
        self._feeds.pop(topic, None)

    def feed(self, topic: str, message: Callable[[], str]) -> None:
        """Queue a message of a topic; if too many wait, the oldest is dropped before it was made."""
        if (feed := self._feeds.get(topic)) is not None:
            feed.waiting.append(message)
            self._news.set()

    def next(self, now_s: float) -> tuple[str | None, float | None]:
        """Take out the frame to send now; else return the seconds until one is due, None if none waits."""
        if self.replies:
            return self.replies.popleft(), None
        waiting = [feed for feed in self._feeds.values() if feed.waiting]
        if not waiting:
            return None, None
        feed = min(waiting, key=lambda each: each.due_s)
        if feed.due_s > now_s:
            return None, feed.due_s - now_s
        feed.due_s = now_s + feed.throttle_s
        return feed.waiting.popleft()(), None

    async def deliver(self, send: Callable[[str], Awaitable[None]]) -> None:
        """Send all frames as they come, until this is cancelled or the client has gone."""
        now_s = asyncio.get_running_loop().time
        while True:
            message, wait_s = self.next(now_s())
            if message is not None:
                await send(message)
                await asyncio.sleep(0)  # others get their turn
                continue
            self._news.clear()
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._news.wait(), wait_s)


class Turns:
    """Queue of the messages of all clients, one of which is handled in each turn of the event loop."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._lock = asyncio.Lock()  # it serves waiting connections in order

    async def take(self, handle: Callable[[], None]) -> None:
        """Handle a message when it is the client's turn."""
        async with self._lock:
            self._clock.catch_up()
            handle()
            self._clock.commanded()
            await asyncio.sleep(0)
