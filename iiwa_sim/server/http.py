"""An HTTP server: requests in, answers out. Needs the library h11.

h11 parses requests and formats answers. Bytes are read and written here, so that all work that a client
causes is charged to the shared budget.
"""

import asyncio
import logging
from collections.abc import Callable
from http import HTTPStatus
from typing import NamedTuple

import h11

from iiwa_sim.server.budget import Budget
from iiwa_sim.server.connection import Connection
from iiwa_sim.server.server import Server
from iiwa_sim.server.socket_options import find_out

LONGEST_BODY = 65_536
"""Largest body of a request in bytes; a larger one is answered 413."""
LONGEST_HEAD = 16_384
"""Most bytes of a request's first line and headers that are buffered; more are answered 431."""
IDLE_S = 60.0
"""Time (s) in which a client has to send its next request completely."""

_BAD_REQUEST, _TOO_LARGE, _INTERNAL = 400, 413, 500
_JSON = "application/json"

logger = logging.getLogger(__name__)


class HttpRequest(NamedTuple):
    """One complete HTTP request."""

    method: str
    path: str
    """Path without the query."""
    headers: tuple[tuple[str, str], ...]
    """Name (in lower case) and value of each header."""
    body: bytes
    client: str
    """HOST:PORT, for the log."""

    def all(self, name: str) -> list[str]:
        """The values of all headers of this name."""
        return [value for each, value in self.headers if each == name]


class HttpAnswer(NamedTuple):
    """Status, body and content type of an answer."""

    status: int
    body: bytes
    kind: str = _JSON
    headers: tuple[tuple[str, str], ...] = ()


Answer = Callable[[HttpRequest], "HttpAnswer | asyncio.Task[HttpAnswer]"]


class HttpServer(Server["HttpConnection"]):
    """Answers all requests to `host`:`port`; port 0 picks a free one."""

    def __init__(self, answer: Answer, host: str, port: int, *, budget: Budget | None = None) -> None:
        """`answer` returns an answer, or a task for one that takes time; the task is cancelled when the
        client goes.

        `budget` may be shared with other servers of the loop.
        """
        super().__init__(lambda: HttpConnection(self), host, port, budget)
        self.answer = answer


class HttpConnection(Connection):
    """One client. Requests are answered one by one; while one is being answered nothing more is read."""

    _server: HttpServer

    def __init__(self, server: HttpServer) -> None:
        super().__init__(server)
        self._http = h11.Connection(h11.SERVER, max_incomplete_event_size=LONGEST_HEAD)
        self._request: h11.Request | None = None
        self._body = bytearray()
        self._task: asyncio.Task[HttpAnswer] | None = None
        self._unread = False  # the last answer has been sent
        self._ends = False  # all further input is discarded

    def _begin(self) -> None:
        self._transport.set_write_buffer_limits(0)
        find_out(self._transport.get_extra_info("socket"))
        self._grant(IDLE_S)

    def buffer_updated(self, nbytes: int) -> None:
        if not self._ends:
            self._transport.pause_reading()
            super().buffer_updated(nbytes)

    def eof_received(self) -> bool:
        if self._ends:
            return False
        super().eof_received()
        return self._task is None  # a task that takes time would go on for nobody

    def pause_writing(self) -> None:
        self._unread = True

    def resume_writing(self) -> None:
        super().resume_writing()
        self._unread = False
        self._share.ask()

    def connection_lost(self, exc: Exception | None) -> None:
        if self._task is not None:
            self._task.cancel()
        super().connection_lost(exc)

    def close(self) -> None:
        """Close at once; data that the system has not taken yet is lost."""
        if self._transport.get_write_buffer_size():
            self._transport.abort()
        else:
            self._transport.close()

    def _work(self, _until_s: float) -> bool:
        """Parse input up to one complete request and answer it; returns whether there is more."""
        if self._transport.is_closing() or self._ends or self._task is not None or self._unread:
            return False
        if self._received:
            self._http.receive_data(self._received)
            self._received = b""
        if self._sent_end:
            self._http.receive_data(b"")
        try:
            return self._take_event()
        except h11.RemoteProtocolError as fault:
            if self._http.our_state in (h11.IDLE, h11.SEND_RESPONSE):
                status = fault.error_status_hint or _BAD_REQUEST
                self._send(HttpAnswer(status, f"{fault}\n".encode(), "text/plain"), last=True)
            else:
                self._transport.close()
        except Exception as fault:  # noqa: BLE001  # told in the log
            self._drop(fault)
        return False

    def _take_event(self) -> bool:
        event = self._http.next_event()
        if event is h11.NEED_DATA:
            if self._http.they_are_waiting_for_100_continue:
                self._write(h11.InformationalResponse(status_code=100, headers=[]))
            self._transport.resume_reading()
            return False
        if isinstance(event, h11.Request):
            self._request, self._body = event, bytearray()
        elif isinstance(event, h11.Data):
            self._body += event.data
            if len(self._body) > LONGEST_BODY:
                told = f"expected a body of at most {LONGEST_BODY} bytes\n"
                self._send(HttpAnswer(_TOO_LARGE, told.encode(), "text/plain"), last=True)
                return False
        elif isinstance(event, h11.EndOfMessage):
            self._answer()
            return self._task is None and not self._ends
        else:  # the end of the stream, or a request after one that closes
            self._transport.close()
            return False
        return True

    def _answer(self) -> None:
        assert self._request is not None
        if self._limit is not None:
            self._limit.cancel()  # an answer may take its time
        target, _, _ = self._request.target.decode("ascii").partition("?")
        request = HttpRequest(
            self._request.method.decode("ascii"),
            target,
            tuple((name.decode("ascii"), value.decode("latin-1")) for name, value in self._request.headers),
            bytes(self._body),
            self._name,
        )
        answer = self._server.answer(request)
        if isinstance(answer, HttpAnswer):
            self._send(answer)
            return
        self._task = answer
        self._transport.resume_reading()  # to learn that the client has gone
        answer.add_done_callback(self._answered)

    def _answered(self, task: "asyncio.Task[HttpAnswer]") -> None:
        if task.cancelled() or self._transport.is_closing():
            return
        self._task = None
        fault = task.exception()
        if fault is not None:
            logger.error("%s: internal error", self._name, exc_info=fault, extra=self._mark)
        self._send(HttpAnswer(_INTERNAL, b"internal error\n", "text/plain") if fault else task.result())
        self._share.ask()

    def _send(self, answer: HttpAnswer, *, last: bool = False) -> None:
        headers = [
            ("content-type", answer.kind),
            ("content-length", str(len(answer.body))),
            ("cache-control", "no-store"),
            *answer.headers,
        ]
        reason = HTTPStatus(answer.status).phrase
        if last:
            headers.append(("connection", "close"))
        self._write(h11.Response(status_code=answer.status, reason=reason, headers=headers))
        if self._request is None or self._request.method != b"HEAD":
            self._write(h11.Data(data=answer.body))
        self._write(h11.EndOfMessage())
        if last or self._http.our_state is h11.MUST_CLOSE:
            self._end()
            return
        self._http.start_next_cycle()
        self._request = None
        self._grant(IDLE_S)

    def _end(self) -> None:
        self._ends = True
        self._transport.resume_reading()
        self._send_end()

    def _write(self, event: h11.Event) -> None:
        data = self._http.send(event)
        if data:
            self._transport.write(data)
