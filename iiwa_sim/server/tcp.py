"""A TCP server for protocols that answer commands: one session for each connection."""

import asyncio
import contextlib
import logging
import socket
import sys
import time
from collections import deque
from collections.abc import Callable

from iiwa_sim.protocols.faults import Close, Reset, Send, Step, Wait, WireFaults
from iiwa_sim.protocols.session import Session
from iiwa_sim.server.budget import Budget
from iiwa_sim.server.connection import Connection, Server
from iiwa_sim.server.listening import reset_at_close

READ_BYTES = 4096
SEND_BYTES = 131_072
"""Size of the system's send buffer. When it is full, replies wait in asyncio's buffer of up to 64 KiB, and
then commands wait."""
MOST_BYTES = 32_768
"""Bytes of replies sent at once."""
MOST_LATE = 1024
"""Replies, parts of replies and delays that wire faults may hold back for one client before its commands
wait."""
UNREAD_S = 10.0
"""Time (s) for which a client may leave its replies unread once all buffers are full."""
CLOSING_S = 0.3
"""Time (s) that a closing server gives its clients to take their last replies."""
LONGEST_PAUSE_S = 86400.0

logger = logging.getLogger(__name__)


class Admission:
    """Admits clients in the order in which they connect, all at once or (`exclusive`) one after the other.

    When no client is left, the next one is admitted `pause_s` later.
    """

    def __init__(self, exclusive: bool = False, pause_s: float = 0.0) -> None:
        """Raises ValueError for a pause that is negative or longer than a day."""
        if not 0.0 <= pause_s <= LONGEST_PAUSE_S:
            raise ValueError(f"reconnect_pause_s is {pause_s}, expected 0 to {LONGEST_PAUSE_S:g} s")
        self._exclusive = exclusive
        self._pause_s = pause_s
        self._served: set[LineConnection] = set()
        self._waiting: dict[LineConnection, None] = {}  # in their order
        self._pause: asyncio.TimerHandle | None = None

    def arrives(self, client: "LineConnection") -> bool:
        """Return whether the client is admitted at once; if not, its `serve` is called later."""
        if self._pause is not None or (self._exclusive and self._served):
            self._waiting[client] = None
            return False
        self._served.add(client)
        return True

    def leaves(self, client: "LineConnection") -> None:
        """Forget a client that has gone, served or not."""
        self._waiting.pop(client, None)
        if client not in self._served:
            return
        self._served.remove(client)
        if self._pause_s and not self._served:
            self._pause = asyncio.get_running_loop().call_later(self._pause_s, self._admit)
        elif self._pause is None:
            self._admit()

    def close(self) -> None:
        """Admit nobody any more."""
        self._waiting.clear()
        self._served.clear()
        if self._pause is not None:
            self._pause.cancel()
            self._pause = None

    def _admit(self) -> None:
        self._pause = None
        while self._waiting and not (self._exclusive and self._served):
            client = next(iter(self._waiting))
            del self._waiting[client]
            self._served.add(client)
            client.serve()


class LineConnection(Connection):
    """One client.

    While lines wait nothing more is read, and while the client leaves replies unread no line is answered: a
    client that floods fills only its own buffers. Nothing is read before the client is admitted. While wire
    faults are set for it, lines are answered one by one, and replies are sent in the steps that the faults
    make of them.
    """

    _server: "TcpServer"
    faulted = False
    """True if a wire fault is set for it, as `WireFaults` says."""

    def __init__(self, server: "TcpServer") -> None:
        super().__init__(server)
        self._unread: asyncio.TimerHandle | None = None  # runs while replies wait to be read
        self._steps: deque[Step] = deque()  # behind the present delay
        self._delay: asyncio.TimerHandle | None = None
        self._served = False
        self._ends = False  # to be closed after what still has to be sent

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        if transport.is_closing():
            return
        if self._server.admission.arrives(self):
            self._served = True
        else:
            logger.info("%s waits for its turn", self._name, extra=self._mark)
            self._transport.pause_reading()

    def serve(self) -> None:
        """Start reading."""
        self._served = True
        logger.info("%s is served", self._name, extra=self._mark)
        self._transport.resume_reading()

    def pause_writing(self) -> None:
        self._unread = self._loop.call_later(self._server.unread_s, self._drop_unread)

    def resume_writing(self) -> None:
        if self._unread is not None:
            self._unread.cancel()
            self._unread = None
        self._share.ask()

    def connection_lost(self, exc: Exception | None) -> None:
        if self._unread is not None:
            self._unread.cancel()
        self._forget_steps()
        self._server.faults.leaves(self._number)
        super().connection_lost(exc)
        self._session.lost()
        self._server.admission.leaves(self)

    def go_on(self) -> None:
        """Answer waiting lines, now that a fault does not hold them back any more."""
        if self._served:
            self._share.ask()

    def take(self, steps: list[Step]) -> None:
        """Queue these steps after those that are pending."""
        self._ends = self._ends or any(isinstance(step, Close | Reset) for step in steps)
        self._steps.extend(steps)
        if self._delay is None:
            self._make_steps()

    def close(self) -> None:
        """Send the replies there are and close; commands without a reply get none."""
        self._ends = True
        self._forget_steps()
        self._transport.close()
        if self._unread is None and self._transport.get_write_buffer_size():
            self._unread = self._loop.call_later(self._server.unread_s, self._drop_unread)

    def _begin(self) -> None:
        tune(self._transport.get_extra_info("socket"))
        self._number = self._server.faults.arrives(self, self._name, self._server.protocol)

    def _answer(self, until_s: float) -> bool:
        if self._ends:
            return False
        answered = bool(self._session.waiting)
        self._answer_lines(until_s)
        if answered and self._server.on_answered is not None:
            self._server.on_answered(self._session.awaits)
        return self._goes_on()

    def _answer_lines(self, until_s: float) -> None:
        session, faults, replies, size, most = self._session, self._server.faults, list[bytes](), 0, 1
        try:
            while session.waiting and not (self._ends or self._is_kept_from_answering()):
                if self.faulted:
                    self._send(replies)
                    self.take(list(faults.steps(self._number, session.answer(1))))
                else:
                    replies.append(session.answer(most))
                    size += len(replies[-1])
                    most *= 2  # The clock is read seldom, but soon enough where lines take long.
                if size >= MOST_BYTES or time.monotonic() >= until_s:
                    break
        finally:
            self._send(replies)

    def _is_kept_from_answering(self) -> bool:
        """Return whether a wire fault, unread replies or a pending reply hold back the next line."""
        pending = self._session.pending
        return (
            (self.faulted and self._server.faults.silences(self._number))
            or len(self._steps) > MOST_LATE
            or self._unread is not None
            or (pending is not None and not pending.done())
        )

    def _send(self, replies: list[bytes]) -> None:
        """Send the replies and forget them."""
        data = b"".join(replies)
        replies.clear()
        if data and self._delay is None:
            self._transport.write(data)
        elif data:
            self._steps.append(Send(data))

    def _goes_on(self) -> bool:
        """Return whether lines can be answered at once; if not, arrange for the work to go on or to end."""
        session = self._session
        if self._ends:
            return False
        if session.waiting:
            self._transport.pause_reading()
            pending = session.pending
            if pending is not None and not pending.done():
                pending.add_done_callback(lambda _: self._share.ask())
                return False
            return not self._is_kept_from_answering()
        if session.closing or self._sent_end:
            self.take([Close()])
        elif self._unread is None:
            self._transport.resume_reading()
        else:
            self._transport.pause_reading()
        return False

    def _make_steps(self) -> None:
        while self._steps:
            step = self._steps.popleft()
            if isinstance(step, Send):
                self._transport.write(step.data)
            elif isinstance(step, Wait):
                self._delay = self._loop.call_later(step.seconds, self._delay_is_over)
                return
            elif isinstance(step, Reset):
                self._forget_steps()
                reset_at_close(self._transport.get_extra_info("socket"))
                self.abort()
            else:
                self.close()
                if self._session.closing and self._server.on_good_bye is not None:
                    self._server.on_good_bye()

    def _delay_is_over(self) -> None:
        self._delay = None
        self._make_steps()
        if self._delay is None:
            self._share.ask()

    def _forget_steps(self) -> None:
        self._steps.clear()
        if self._delay is not None:
            self._delay.cancel()
            self._delay = None

    def _drop_unread(self) -> None:
        unread_s = self._server.unread_s
        logger.warning("%s dropped: left its replies unread for %g s", self._name, unread_s, extra=self._mark)
        self.abort()


class TcpServer(Server[LineConnection]):
    """Serves one session, from `open_session(client name)`, for every connection to `host`:`port`.

    A client that does not read its replies for `unread_s` is dropped. A client that waits to be admitted is
    connected, but nothing is read from it. `on_answered` is called after commands have been executed, with
    what the session `awaits`, `on_good_bye` after a client has said good-bye and been answered.
    """

    def __init__(
        self,
        open_session: Callable[[str], Session],
        host: str,
        port: int,
        *,
        unread_s: float = UNREAD_S,
        admission: Admission | None = None,
        budget: Budget | None = None,
        on_answered: Callable[[bool], None] | None = None,
        on_good_bye: Callable[[], None] | None = None,
        faults: WireFaults | None = None,
        protocol: str = "",
    ) -> None:
        """`admission`, `budget` and wire `faults` may be shared with other servers of the loop.

        `protocol` names the protocol of this port, where `faults` are shared with ports of other protocols.
        """
        super().__init__(lambda: LineConnection(self), open_session, host, port, budget, READ_BYTES)
        self.unread_s = unread_s
        self.admission = admission or Admission()
        self.on_answered = on_answered
        self.on_good_bye = on_good_bye
        self.faults = faults or WireFaults()
        self.protocol = protocol

    async def close(self) -> None:
        """Stop listening and close every connection; takes little more than CLOSING_S at most."""
        self.admission.close()
        late = asyncio.get_running_loop().call_later(CLOSING_S, self._abort_all)
        await super().close()
        late.cancel()

    def _abort_all(self) -> None:
        for connection in list(self.connections):
            connection.abort()


def tune(connection: socket.socket) -> None:
    """Disable Nagle's algorithm, size the send buffer, and detect a vanished host in about 11 s."""
    with contextlib.suppress(OSError):  # already gone
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BYTES)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        if sys.platform == "linux":
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, 5)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, 2)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT, 3)
