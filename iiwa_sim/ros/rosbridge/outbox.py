"""The queue of frames for one client of rosbridge, bounded whatever the client asks for and however slowly
it reads."""

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

MOST_REPLIES = 1000
MOST_REPLY_LETTERS = 4_194_304
LONGEST_FEED = 1000


Frame = str | bytes
"""Text, or what goes into a binary frame."""
Unmade = Callable[[], Frame]
"""Makes a frame at the time of sending."""


class Next(NamedTuple):
    """The next thing to do for a sender."""

    message: Frame | None
    """The frame to send now, if there is one."""
    wait_s: float | None
    """Otherwise seconds until one is due; None if none waits."""


class _Feed:
    """The messages of one topic."""

    def __init__(self) -> None:
        self.throttle_s = 0.0
        self.waiting: deque[Unmade] = deque(maxlen=1)
        self.due_s = 0.0


class Outbox:
    """Replies are sent in order, before messages of topics. Times are of one clock, in s."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """`wake` is called when there may be something to send."""
        self.overflown = False
        """Whether the client has left too many replies unread: nothing more is kept for it."""
        self._wake = wake
        self._replies: deque[Frame] = deque()
        self._reply_letters = 0
        self._feeds: dict[str, _Feed] = {}

    def reply(self, message: Frame) -> None:
        """Queue a message that must not be lost."""
        if self.overflown:
            return
        self._replies.append(message)
        self._reply_letters += len(message)
        if len(self._replies) > MOST_REPLIES or self._reply_letters > MOST_REPLY_LETTERS:
            self.overflown = True
            self._replies.clear()
            self._feeds.clear()
        self._wake()

    def set_feed(self, topic: str, throttle_s: float, queue_length: int) -> None:
        """Send messages of a topic at least `throttle_s` apart; of those that wait, `queue_length` are
        kept, at least the newest."""
        feed = self._feeds.setdefault(topic, _Feed())
        feed.throttle_s = throttle_s
        feed.waiting = deque(feed.waiting, maxlen=min(max(queue_length, 1), LONGEST_FEED))

    def end_feed(self, topic: str) -> None:
        """Drop the waiting messages of a topic."""
        self._feeds.pop(topic, None)

    def feed(self, topic: str, message: Unmade) -> None:
        """Queue a message of a topic; if too many wait the oldest is dropped, before any work was done for
        it."""
        feed = self._feeds.get(topic)
        if feed is None:
            return
        first = not feed.waiting
        feed.waiting.append(message)
        if first:  # otherwise the sender has been woken already
            self._wake()

    def next(self, now_s: float) -> Next:
        """Take out the next frame to send."""
        if self._replies:
            message = self._replies.popleft()
            self._reply_letters -= len(message)
            return Next(message, None)
        waiting = [feed for feed in self._feeds.values() if feed.waiting]
        if not waiting:
            return Next(None, None)
        feed = min(waiting, key=lambda each: each.due_s)
        if feed.due_s > now_s:
            return Next(None, feed.due_s - now_s)
        feed.due_s = now_s + feed.throttle_s
        return Next(feed.waiting.popleft()(), None)
