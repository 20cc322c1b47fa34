"""A fair scheduler: one budget of CPU time that all connections of all ports share.

Each connection has a share. A client that asks now and then is served before the clients that always have
more work waiting, so its reply does not wait for theirs. Among the busy clients the one that has used the
least time comes next. The ticks that are due are made before each piece of work, and after `TURN_S` of work
the event loop runs once, so that new connections and data are noticed.
"""

import asyncio
import heapq
import time
from collections import deque
from collections.abc import Callable
from itertools import count

PIECE_S = 0.0001
"""Time for which one share works without a break while others wait: enough for some replies."""
TURN_S = 0.0005
"""Time for which shares work before the event loop runs again."""
QUIET_TURNS = 2
"""Turns without work after which a share counts as one that asks now and then. A client that sends without
a pause is read again in the next turn, also on a machine so busy that turns are long."""
OFTEN = 3
"""A share whose early requests outnumber its late ones by this many is busy. A single early request proves
little: on a busy machine turns are so long that a patient client, too, is back within one."""
MOST_OFTEN = 6
"""Upper bound of that count: after at most MOST_OFTEN - OFTEN late requests a busy share is a patient one
again."""
MOST_AHEAD_S = 0.0002
"""Most time that a share may have used more than others, so that it waits for two rounds of all shares at
most."""
OVERHEAD_S = 0.00003
"""Time charged for each piece besides its own work: a read, a write and what else comes with them."""


class Budget:
    """The time of one event loop, and how much of it each share has used.

    A piece of work is not interrupted; the share of a long one waits longer for its next.
    """

    def __init__(
        self,
        first: Callable[[], None] = lambda: None,
        *,
        now_s: Callable[[], float] = time.monotonic,
        spent_s: Callable[[], float] = time.thread_time,
    ) -> None:
        """`first` is called before each piece and makes the ticks that are due.

        `now_s` is the clock by which turns end. `spent_s` is the clock by which shares are charged: the CPU
        time of the thread, so that no share pays for other processes of the machine.
        """
        self._first = first
        self._now_s = now_s
        self._spent_s = spent_s
        self._now_and_then: deque[Share] = deque()
        self._waiting: list[tuple[float, int, Share]] = []  # busy shares, a heap
        self._arrivals = count()  # breaks ties between shares that have used the same time
        self._used_s = 0.0  # of the busy share that was served last, before its piece
        self._served: Share | None = None  # at this instant
        self._turns = 0  # in which there was work
        self._turn: asyncio.Handle | None = None
        self.crowded = False
        """Whether any share waits for its turn."""

    def share(self, work: Callable[[float], bool]) -> "Share":
        """A new share for one connection.

        `work(until_s)` does some of the waiting work, at least one step and not beyond `until_s`, and returns
        whether there is more.
        """
        return Share(self, work)

    def _ask(self, share: "Share", at_once: bool) -> None:
        if at_once and self._served is None and not self.crowded:
            self._used_s = max(self._used_s, share.used_s)
            self._serve(share, TURN_S)
        elif share is not self._served and self._asks_now_and_then(share):
            share.waits = True
            self._now_and_then.append(share)
            self._go_on()
        else:
            self._queue(share)

    def _asks_now_and_then(self, share: "Share") -> bool:
        soon = self._turns - share.idle_since_turn < QUIET_TURNS
        share.often = min(share.often + 1, MOST_OFTEN) if soon else max(share.often - 1, 0)
        return share.often < OFTEN

    def _queue(self, share: "Share") -> None:
        share.waits = True
        # A share that was idle does not save up time, and one that has used much does not have to make up for
        # all of it: its wait would be multiplied by the number of shares.
        share.used_s = min(max(share.used_s, self._used_s), self._used_s + MOST_AHEAD_S)
        heapq.heappush(self._waiting, (share.used_s, next(self._arrivals), share))
        self._go_on()

    def _go_on(self) -> None:
        self.crowded = True
        if self._turn is None:
            self._turn = asyncio.get_running_loop().call_soon(self._take_turn)

    def _take_turn(self) -> None:
        self._turn = None
        self._turns += 1
        begun_s = self._now_s()
        while self._now_and_then and self._now_s() < begun_s + TURN_S / 2:
            self._serve_next(self._now_and_then.popleft())
        end_s = self._now_s() + TURN_S / 2 if self._now_and_then else begun_s + TURN_S
        while self._waiting:  # at least one, however many patient shares wait
            used_s, _, share = heapq.heappop(self._waiting)
            self._used_s = max(self._used_s, used_s)
            self._serve_next(share)
            if self._now_s() >= end_s:
                break
        if self.crowded:
            self._go_on()

    def _serve_next(self, share: "Share") -> None:
        """Serve a share that has just been taken out of those that wait."""
        self.crowded = bool(self._waiting or self._now_and_then)
        if not share.left:
            share.waits = False
            self._serve(share, PIECE_S if self.crowded else TURN_S)

    def _serve(self, share: "Share", piece_s: float) -> None:
        self._served = share
        try:
            self._first()
            spent_s = self._spent_s()
            share.used_s = max(share.used_s, self._used_s)
            more = share.work(self._now_s() + piece_s)
            share.idle_since_turn = self._turns
            share.used_s += self._spent_s() - spent_s + OVERHEAD_S
        finally:
            self._served = None
        if more and not share.waits and not share.left:
            self._queue(share)


class Share:
    """The part of a budget that belongs to one connection."""

    def __init__(self, budget: Budget, work: Callable[[float], bool]) -> None:
        self.work = work
        self.used_s = 0.0
        """CPU time used, in s."""
        self.idle_since_turn = budget._turns - QUIET_TURNS
        """Number of the turn in which its last work was done."""
        self.often = 0
        """Early requests minus late ones, bounded by 0 and MOST_OFTEN."""
        self.waits = False
        """Whether it has asked for time and has not had it yet."""
        self.left = False
        self._budget = budget

    def ask(self) -> None:
        """Ask for time: the work is done at once if no share waits, otherwise when it is its turn."""
        if not self.waits and not self.left:
            self._budget._ask(self, at_once=True)

    def ask_later(self) -> None:
        """Ask for time after the caller has returned."""
        if not self.waits and not self.left:
            self._budget._ask(self, at_once=False)

    def charge(self, took_s: float) -> None:
        """Charge `took_s` (s) for work that was done elsewhere on behalf of this share."""
        self.used_s = max(self.used_s, self._budget._used_s) + took_s

    def leave(self) -> None:
        """Withdraw: no more work is done for this share."""
        self.left = True
