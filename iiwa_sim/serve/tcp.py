"""A TCP server for dialects that answer lines: one session per connection, one write per batch of replies."""

import asyncio
import logging
import time
from collections.abc import Callable
from functools import partial

from iiwa_sim.dialect.session import Session
from iiwa_sim.dialect.wire.wire_faults import Reset, Send, Step, Wait, WireFaults
from iiwa_sim.serve.budget import Budget
from iiwa_sim.serve.door import Door
from iiwa_sim.serve.first_line import FirstLine, FromBrowserFault
from iiwa_sim.serve.in_order import InOrder
from iiwa_sim.serve.listening import peer_of, why
from iiwa_sim.serve.socket_options import reset_at_close, tune
from iiwa_sim.serve.turns import Turns

RECEIVE_BYTES = 65_536
"""Bytes taken from a connection at once. A buffer of our own instead of asyncio's, which allocates 256 KiB
for every read, makes an answer 30 us faster."""
CROWDED_BYTES = 4096
"""The same while others wait: to take lines apart costs time, too."""
MOST_BYTES = 32_768
"""Of replies that are sent at once."""

UNREAD_S = 10.0
"""For how long a client may leave its replies unread once all buffers are full."""

CLOSING_S = 0.3
"""What a closing server grants its clients to take their last replies."""

MOST_LATE = 1024
"""Replies, parts of them and waits that a fault may keep back for one client, before its commands wait."""

logger = logging.getLogger(__name__)


class TcpServer:
    """Serves `open_session(name of the client)` for every connection to `host`:`port`.

    `port` 0 picks a free one; `address` says which. A host name stands for its first address, IPv4 before
    IPv6. A client that does not read its replies for `unread_s` is dropped. One that has to wait for its turn
    is connected, but nothing is read from it. `on_answered` is called when lines of a client have been
    carried out, `on_good_bye` when it has said good-bye and been answered. What befalls replies on their way
    is in `faults`.
    """

    def __init__(
        self,
        open_session: Callable[[str], Session],
        host: str,
        port: int,
        *,
        unread_s: float = UNREAD_S,
        turns: Turns | None = None,
        budget: Budget | None = None,
        on_answered: Callable[[], None] | None = None,
        on_good_bye: Callable[[], None] | None = None,
        faults: WireFaults | None = None,
        dialect: str = "",
    ) -> None:
        """`turns` says who is served when; all clients at once, if it is not given. `budget` is shared with
        other servers of the loop.

        `dialect` is what is spoken here, where clients of others are among the same `faults`.
        """
        self.open_session = open_session
        self.unread_s = unread_s
        self.turns = turns or Turns()
        self.budget = budget or Budget()
        self.buffer = memoryview(bytearray(RECEIVE_BYTES))  # of all connections: it is emptied at once
        self.on_answered = on_answered
        self.on_good_bye = on_good_bye
        self.faults = faults or WireFaults()
        self.dialect = dialect
        self.connections: set[Connection] = set()
        self.listening = False
        self._door = Door(lambda: Connection(self), host, port)

    async def start(self) -> None:
        """Listen. Raises ListenFault."""
        await self._door.open()
        self.listening = True

    @property
    def address(self) -> tuple[str, int]:
        """Host and port listened on."""
        return self._door.address

    def refuse(self) -> None:
        """Let nobody connect until `accept`; who is connected is served. Raises ListenFault."""
        self._door.refuse()

    def accept(self) -> None:
        """Let clients connect again."""
        self._door.accept()

    def drop_arriving(self, *, reset: bool) -> None:
        """Close, or reset, the connections that are there and not served yet."""
        self._door.drop_arriving(reset=reset)

    async def close(self) -> None:
        """Listen no more and close every connection; takes a little more than CLOSING_S at most."""
        if not self.listening:
            return
        self.listening = False
        self._door.close()
        self.turns.close()
        open_connections = list(self.connections)
        for connection in open_connections:
            connection.close()
        for grace_s in (CLOSING_S, None):
            if gone := [connection.gone for connection in self.connections]:
                await asyncio.wait(gone, timeout=grace_s)
            for connection in list(self.connections):
                connection.abort()


class Connection(asyncio.BufferedProtocol):
    """One client.

    Lines are answered as the budget has time for them, with other clients and ticks in between. While lines
    wait nothing more is read, and while the client leaves replies unread no line is answered: a client in a
    hurry fills its own buffers and nobody else's. Until its turn comes nothing is read either. While faults
    are set for it, lines are answered one by one, and replies sent in the steps that the faults make of them.
    """

    _transport: asyncio.Transport
    _session: Session
    gone: asyncio.Future[None]
    """Done once the connection is."""

    def __init__(self, server: TcpServer) -> None:
        self._server = server
        self._loop = asyncio.get_running_loop()
        self._first_line = FirstLine()
        self._received = b""  # and not handed to the session yet
        self._unread: asyncio.TimerHandle | None = None  # runs while replies pile up
        self._served = False
        self._reading = True
        self._sent_end = False
        self._told_end = False  # the session knows
        self._ends = False  # with what is still to be sent
        self._finished = False

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        self.gone = self._loop.create_future()
        self._name = peer_of(transport)
        self._mark = {"fields": {"session": self._name}}
        tune(transport.get_extra_info("socket"))
        self._session = self._server.open_session(self._name)
        self._share = self._server.budget.share(self._work)
        self._outgoing = InOrder(self._share.ask)
        self._number = self._server.faults.arrives(self, self._name, self._server.dialect)
        self._server.connections.add(self)
        logger.info("%s connected", self._name, extra=self._mark)
        if not self._server.listening:  # accepted while the server closed
            self.close()
        elif self._server.turns.arrives(self):
            self._served = True
        else:
            logger.info("%s waits for its turn", self._name, extra=self._mark)
            self._read(False)

    def serve(self) -> None:
        """Begin to read."""
        self._served = True
        logger.info("%s is served", self._name, extra=self._mark)
        self._read(True)

    def get_buffer(self, _sizehint: int) -> memoryview:
        server = self._server
        return server.buffer[:CROWDED_BYTES] if server.budget.crowded else server.buffer

    def buffer_updated(self, nbytes: int) -> None:
        self._received += self._server.buffer[:nbytes]
        if self._share.waits:
            self._read(False)
        else:
            self._share.ask()

    def eof_received(self) -> bool:
        self._sent_end = True
        self._share.ask()
        return True  # the transport stays open for the replies

    def pause_writing(self) -> None:
        self._unread = self._loop.call_later(self._server.unread_s, self._drop)

    def resume_writing(self) -> None:
        if self._unread is not None:
            self._unread.cancel()
            self._unread = None
        self._share.ask()

    def connection_lost(self, exc: Exception | None) -> None:
        self._finished = True
        self._share.leave()
        if self._unread is not None:
            self._unread.cancel()
        self._outgoing.forget()
        self._server.connections.discard(self)
        self._server.faults.leaves(self._number)
        self.gone.set_result(None)
        logger.info("%s disconnected%s", self._name, f": {why(exc)}" if exc else "", extra=self._mark)
        self._session.lost()
        self._server.turns.leaves(self)

    def go_on(self) -> None:
        """Answer what waits, if it is no more kept from it."""
        if self._served:
            self._share.ask()

    def take(self, steps: list[Step]) -> None:
        """Take these steps, behind those that are still to be taken."""
        for step in steps:
            if isinstance(step, Send):
                self._outgoing.do(partial(self._transport.write, step.data))
            elif isinstance(step, Wait):
                self._outgoing.wait(step.seconds)
            else:
                self._ends = True
                self._outgoing.do(self._reset if isinstance(step, Reset) else self.close)

    def close(self) -> None:
        """Send what is answered and close; what has not been answered is not any more."""
        self._finished = True
        self._outgoing.forget()
        self._transport.close()
        if self._unread is None and self._transport.get_write_buffer_size():
            self._unread = self._loop.call_later(self._server.unread_s, self._drop)

    def abort(self) -> None:
        """Close at once."""
        self._transport.abort()

    def _work(self, until_s: float) -> bool:
        """Answer lines until then; whether more can be answered."""
        if self._finished or self._ends:
            return False
        try:
            self._hand_on()
            answered = self._session.waiting
            self._answer(until_s)
        except FromBrowserFault as fault:
            logger.warning(
                "%s closed: it sent %s, as a web page would have it", self._name, fault, extra=self._mark
            )
            self.abort()
            return False
        except Exception:
            logger.exception("%s dropped: internal fault", self._name, extra=self._mark)
            self.abort()
            return False
        if answered and self._server.on_answered is not None:
            self._server.on_answered()
        return self._goes_on()

    def _hand_on(self) -> None:
        """To the session, what has been received."""
        data, self._received = self._received, b""
        first = self._first_line
        if data:
            self._session.receive(data if first.passed else first.take(data))
        if self._sent_end and not self._told_end:
            self._told_end = True
            if not first.passed:
                self._session.receive(first.rest())
            self._session.end()

    def _answer(self, until_s: float) -> None:
        session, faults, replies, size, most = self._session, self._server.faults, list[bytes](), 0, 1
        try:
            while session.waiting and not (self._ends or self._is_kept_from_answering()):
                if faults.concerns(self._number):
                    self._send(replies)
                    self.take(list(faults.steps(self._number, session.answer(1))))
                else:
                    replies.append(session.answer(most))
                    size += len(replies[-1])
                    most *= 2  # the clock is looked at seldom, and yet soon where lines take their time
                if size >= MOST_BYTES or time.monotonic() >= until_s:
                    break
        finally:
            self._send(replies)

    def _is_kept_from_answering(self) -> bool:
        """By a fault that is set, by replies that are not sent or not read yet, or by what takes its time."""
        pending = self._session.pending
        return (
            self._server.faults.silences(self._number)
            or len(self._outgoing) > MOST_LATE
            or self._unread is not None
            or (pending is not None and not pending.done())
        )

    def _send(self, replies: list[bytes]) -> None:
        """And forget them."""
        data = b"".join(replies)
        replies.clear()
        if not data:
            return
        if self._outgoing.busy:
            self.take([Send(data)])
        else:
            self._transport.write(data)

    def _goes_on(self) -> bool:
        """Whether lines can be answered at once; if not, see to it that it goes on or ends."""
        session = self._session
        if self._finished or self._ends:
            return False
        if session.closing:
            self._ends = True
            self._outgoing.do(self._good_bye)
            return False
        if session.waiting:
            self._read(False)
            pending = session.pending
            if pending is not None and not pending.done():
                pending.add_done_callback(lambda _: self._share.ask())
                return False
            return not self._is_kept_from_answering()
        if self._sent_end:
            self._ends = True
            self._outgoing.do(self.close)
            return False
        self._read(self._unread is None)
        return False

    def _good_bye(self) -> None:
        self.close()
        if self._server.on_good_bye is not None:
            self._server.on_good_bye()

    def _reset(self) -> None:
        self._finished = True
        reset_at_close(self._transport.get_extra_info("socket"))
        self.abort()

    def _read(self, wanted: bool) -> None:
        if wanted != self._reading and not self._sent_end:
            self._reading = wanted
            if wanted:
                self._transport.resume_reading()
            else:
                self._transport.pause_reading()

    def _drop(self) -> None:
        unread_s = self._server.unread_s
        logger.warning("%s dropped: left its replies unread for %g s", self._name, unread_s, extra=self._mark)
        self.abort()
