"""Whose work is done next: one budget of time, shared by all connections of all ports.

Each connection has a share. Who asks now and then is served before those who always have more to do: so it
does not wait long, however many these are. Of these, the one that has used up the least comes next. Before
each piece of work the robot's ticks that are due are made, and after `TURN_S` of work the event loop gets its
turn, in which it hears of those who come anew.
"""

import asyncio
import heapq
import time
from collections import deque
from collections.abc import Callable
from itertools import count

PIECE_S = 0.0001
"""Work for one share without a break while others wait: some answers."""
TURN_S = 0.0005
"""Work for all of them before the event loop gets its turn."""
QUIET_TURNS = 2
"""Without anything to do, for a share that asks now and then. Who sends without end is read in the next turn,
also on a machine so busy that turns are long."""
OFTEN = 3
"""Asked sooner than that so many times more than not, a share counts no longer as one that asks now and then.
Once means little: a busy machine makes turns so long that somebody patient, too, comes back within one."""
MOST_OFTEN = 6
"""Times that count: so often it asks late until it is one again, but for OFTEN."""
MOST_AHEAD_S = 0.0002
"""That a share may have used up more than others: so it waits two rounds of all at the most."""
OVERHEAD_S = 0.00003
"""Counted on top for each piece: a read, a write, and whatever else comes with it."""


class Budget:
    """The time of one event loop, and who has used up how much of it.

    A piece of work is not interrupted; one that takes long makes its share wait the longer.
    """

    def __init__(
        self,
        first: Callable[[], None] = lambda: None,
        *,
        now_s: Callable[[], float] = time.monotonic,
        spent_s: Callable[[], float] = time.thread_time,
    ) -> None:
        """`first` is called before each piece, and does what must not wait: ticks that are due.

        Turns end by `now_s`. Shares use up what `spent_s` counts, so nobody pays for what else the machine
        does meanwhile.
        """
        self._first = first
        self._now_s = now_s
        self._spent_s = spent_s
        self._now_and_then: deque[Share] = deque()
        self._waiting: list[tuple[float, int, Share]] = []  # all others, a heap
        self._arrivals = count()  # tells those apart who have used up the same
        self._used_s = 0.0  # by the one of those others that was last served, before its piece
        self._served: Share | None = None  # at this instant
        self._turns = 0  # in which there was work
        self._turn: asyncio.Handle | None = None

    def share(self, work: Callable[[float], bool]) -> "Share":
        """A share for one connection.

        `work(until_s)` does what there is to do, at least a little of it and for no longer than that, and
        says whether there is more.
        """
        return Share(self, work)

    @property
    def crowded(self) -> bool:
        """Whether anybody waits."""
        return bool(self._waiting or self._now_and_then)

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
        # Who was idle does not save up time, and who has used up much has not to make up for all of it, or
        # that would be as many times as long as there are others.
        share.used_s = min(max(share.used_s, self._used_s), self._used_s + MOST_AHEAD_S)
        heapq.heappush(self._waiting, (share.used_s, next(self._arrivals), share))
        self._go_on()

    def _go_on(self) -> None:
        if self._turn is None:
            self._turn = asyncio.get_running_loop().call_soon(self._take_turn)

    def _take_turn(self) -> None:
        self._turn = None
        self._turns += 1
        begun_s = self._now_s()
        while self._now_and_then and self._now_s() < begun_s + TURN_S / 2:
            self._serve_next(self._now_and_then.popleft())
        end_s = self._now_s() + TURN_S / 2 if self._now_and_then else begun_s + TURN_S
        while self._waiting:  # one at the least, however many ask now and then
            used_s, _, share = heapq.heappop(self._waiting)
            self._used_s = max(self._used_s, used_s)
            self._serve_next(share)
            if self._now_s() >= end_s:
                break
        if self.crowded:
            self._go_on()

    def _serve_next(self, share: "Share") -> None:
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
    """What one connection has of a budget."""

    def __init__(self, budget: Budget, work: Callable[[float], bool]) -> None:
        self.work = work
        self.used_s = 0.0
        """Of the budget's time."""
        self.idle_since_turn = budget._turns - QUIET_TURNS
        """In which its last piece of work had been done."""
        self.often = 0
        """How many times more it asked again soon than late, from 0 to MOST_OFTEN."""
        self.waits = False
        """Whether it has asked, and its work is still to be done."""
        self.left = False
        self._budget = budget

    def ask(self) -> None:
        """There is work: it is done at once if nobody waits, otherwise when its time has come."""
        if not self.waits and not self.left:
            self._budget._ask(self, at_once=True)

    def ask_later(self) -> None:
        """There is work, which is not to be done before the caller has ended."""
        if not self.waits and not self.left:
            self._budget._ask(self, at_once=False)

    def charge(self, took_s: float) -> None:
        """Something was done for it elsewhere, and took so long."""
        self.used_s = max(self.used_s, self._budget._used_s) + took_s

    def leave(self) -> None:
        """Nothing is to be done for it any more."""
        self.left = True
