"""One client of a TCP server: lines in as the budget has time, one write for each batch of replies."""

import asyncio
import logging
import time
from functools import partial
from typing import TYPE_CHECKING, Any

from iiwa_sim.protocols.faults import Reset, Send, Step, Wait
from iiwa_sim.protocols.session import Session
from iiwa_sim.server.connection import Connection
from iiwa_sim.server.first_line import FirstLine
from iiwa_sim.server.in_order import InOrder
from iiwa_sim.server.socket_options import reset_at_close, tune

if TYPE_CHECKING:
    from iiwa_sim.server.server import Server
    from iiwa_sim.server.tcp import TcpServer

MOST_BYTES = 32_768
"""Bytes of replies sent at once."""

MOST_LATE = 1024
"""Replies, parts of replies and delays that wire faults may hold back for one client before its commands
wait."""

logger = logging.getLogger(__name__)


class SessionConnection(Connection):
    """One client of a session of lines."""

    _session: Session

    def __init__(self, server: "Server[Any]", what: str = "") -> None:
        super().__init__(server, what)
        self._first_line = FirstLine()
        self._told_end = False  # the session has been told of the end

    def _hand_on(self) -> None:
        """Pass the received bytes on to the session. Raises FromBrowserFault."""
        data, self._received = self._received, b""
        first = self._first_line
        if data:
            self._session.receive(data if first.passed else first.take(data))
        if self._sent_end and not self._told_end:
            self._told_end = True
            if not first.passed:
                self._session.receive(first.rest())
            self._session.end()


class LineConnection(SessionConnection):
    """One client.

    Its lines are answered as the budget allows, between those of other clients and ticks. While lines wait
    nothing more is read, and while the client leaves replies unread no line is answered: a client that floods
    fills only its own buffers. Nothing is read before the client is admitted. While wire faults are set for
    it, lines are answered one by one, and replies are sent in the steps that the faults make of them.
    """

    _server: "TcpServer"
    faulted = False
    """Whether a wire fault is set for it, as `WireFaults` tells."""

    def __init__(self, server: "TcpServer") -> None:
        super().__init__(server)
        self._unread: asyncio.TimerHandle | None = None  # runs while replies wait to be read
        self._served = False
        self._ends = False  # to be closed after what still has to be sent
        self._finished = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        if self._finished:
            return
        if self._server.admission.arrives(self):
            self._served = True
        else:
            logger.info("%s waits for its turn", self._name, extra=self._mark)
            self._transport.pause_reading()

    def _begin(self) -> None:
        tune(self._transport.get_extra_info("socket"))
        self._session = self._server.open_session(self._name)
        self._outgoing = InOrder(self._share.ask)
        self._number = self._server.faults.arrives(self, self._name, self._server.protocol)
        self._tell_connected()

    def serve(self) -> None:
        """Start reading."""
        self._served = True
        logger.info("%s is served", self._name, extra=self._mark)
        self._transport.resume_reading()

    def get_buffer(self, _sizehint: int) -> memoryview:  # the base's, beside what comes next of a command
        return self._server.buffer

    def buffer_updated(self, nbytes: int) -> None:  # the base's, without a call more for each command
        self._received += self._server.buffer[:nbytes]
        if self._share.waits:
            self._transport.pause_reading()
        else:
            self._share.ask()

    def pause_writing(self) -> None:
        self._unread = self._loop.call_later(self._server.unread_s, self._drop_unread)

    def resume_writing(self) -> None:
        if self._unread is not None:
            self._unread.cancel()
            self._unread = None
        self._share.ask()

    def connection_lost(self, exc: Exception | None) -> None:
        self._finished = True
        if self._unread is not None:
            self._unread.cancel()
        self._outgoing.forget()
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
        for step in steps:
            if isinstance(step, Send):
                self._outgoing.do(partial(self._transport.write, step.data))
            elif isinstance(step, Wait):
                self._outgoing.wait(step.seconds)
            else:
                self._ends = True
                self._outgoing.do(self._reset if isinstance(step, Reset) else self.close)

    def close(self) -> None:
        """Send the replies there are and close; commands without a reply get none."""
        self._finished = True
        self._outgoing.forget()
        self._transport.close()
        if self._unread is None and self._transport.get_write_buffer_size():
            self._unread = self._loop.call_later(self._server.unread_s, self._drop_unread)

    def _work(self, until_s: float) -> bool:
        """Answer lines until `until_s`; returns whether more can be answered."""
        if self._finished or self._ends:
            return False
        try:
            self._hand_on()
            answered = bool(self._session.waiting)
            self._answer(until_s)
        except Exception as fault:  # noqa: BLE001  # told in the log
            self._drop(fault)
            return False
        if answered and self._server.on_answered is not None:
            self._server.on_answered(self._session.awaits)
        return self._goes_on()

    def _answer(self, until_s: float) -> None:
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
        """Whether a wire fault, unsent or unread replies, or a pending reply hold back the next line."""
        pending = self._session.pending
        return (
            (self.faulted and self._server.faults.silences(self._number))
            or (self._outgoing.busy and len(self._outgoing) > MOST_LATE)
            or self._unread is not None
            or (pending is not None and not pending.done())
        )

    def _send(self, replies: list[bytes]) -> None:
        """Send the replies and forget them."""
        data = b"".join(replies)
        replies.clear()
        if not data:
            return
        if self._outgoing.busy:
            self.take([Send(data)])
        else:
            self._transport.write(data)

    def _goes_on(self) -> bool:
        """Whether lines can be answered at once; if not, arrange for the work to go on later or to end."""
        session = self._session
        if self._finished or self._ends:
            return False
        if session.closing:
            self._ends = True
            self._outgoing.do(self._good_bye)
            return False
        if session.waiting:
            self._transport.pause_reading()
            pending = session.pending
            if pending is not None and not pending.done():
                pending.add_done_callback(lambda _: self._share.ask())
                return False
            return not self._is_kept_from_answering()
        if self._sent_end:
            self._ends = True
            self._outgoing.do(self.close)
            return False
        if self._unread is None:
            self._transport.resume_reading()
        else:
            self._transport.pause_reading()
        return False

    def _good_bye(self) -> None:
        self.close()
        if self._server.on_good_bye is not None:
            self._server.on_good_bye()

    def _reset(self) -> None:
        self._finished = True
        reset_at_close(self._transport.get_extra_info("socket"))
        self.abort()

    def _drop_unread(self) -> None:
        unread_s = self._server.unread_s
        logger.warning("%s dropped: left its replies unread for %g s", self._name, unread_s, extra=self._mark)
        self.abort()
