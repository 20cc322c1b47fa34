"""The backdoor over HTTP: `POST /METHOD` calls a method of `Backdoor` with a JSON object of its arguments.

A key is the name of an argument, or its place from 0. With several robots, `POST /ROBOT/METHOD` calls the
method of one.

The calls and their parameters come from the signatures of `Backdoor`. A call is made between two ticks, in
the loop's thread; its connection waits in a thread of its own.
"""

import asyncio
import contextlib
import inspect
import logging
import socket
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import CancelledError, Future
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from typing import Any, NamedTuple, get_type_hints
from urllib.parse import parse_qsl, unquote, urlsplit

import msgspec

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, Refused
from iiwa_sim.server.listening import Acceptor
from iiwa_sim.server.token import fits
from iiwa_sim.server.web_access import LOCALHOST, WebAccess
from iiwa_sim.wording import harmless, shortened

HEALTH = "healthz"
CAMERA = "camera"
MOST_BYTES = 65_536
"""Largest body."""
MOST_CONNECTIONS = 32
IDLE_S = 60.0
"""Time (s) after which a connection without a request is closed."""
LONGEST_SHOWN = 400
"""Characters of a request in the log, and of a reason."""

logger = logging.getLogger(__name__)


class Call(NamedTuple):
    """A method of the backdoor as clients see it."""

    method: Callable[..., Any]
    arguments: type[msgspec.Struct]
    takes: list[str]
    """The parameters, with their defaults: `connection=0`."""
    reads: bool
    """True if it only reads."""
    summary: str


def _call(method: Callable[..., Any]) -> Call:
    types, parameters = get_type_hints(method), list(inspect.signature(method).parameters.values())[1:]
    given = [msgspec.NODEFAULT if each.default is each.empty else each.default for each in parameters]
    fields = [(each.name, types[each.name], default) for each, default in zip(parameters, given, strict=True)]
    reads = types["return"] is bytes or not (
        types["return"] is type(None) or inspect.iscoroutinefunction(method)
    )
    summary = (inspect.getdoc(method) or "").partition("\n\n")[0].replace("\n", " ")
    arguments = msgspec.defstruct(method.__name__, fields, forbid_unknown_fields=True)
    takes = [str(each.replace(annotation=each.empty)) for each in parameters]
    return Call(method, arguments, takes, reads, summary)


CALLS = {
    name: _call(method)
    for name, method in vars(Backdoor).items()
    if inspect.isfunction(method) and not name.startswith("_")
}
"""Calls by name."""


class NoCall(Refused):
    """A request that is no call, with its HTTP status. It ends the connection."""

    def __init__(self, status: HTTPStatus, reason: str) -> None:
        super().__init__(COMMUNICATION_FAILURE, harmless(shortened(reason, LONGEST_SHOWN)))
        self.status = status


class BackdoorHttp:
    """HTTP server of a backdoor on `host`:`port` from `start` to `close`; port 0 picks a free one.

    With a `token`, requests have to carry it (`Authorization: Bearer TOKEN`), except for `/healthz`. Web
    pages are rejected: a browser names the page in the header Origin, and a rebound host name shows in Host.
    """

    def __init__(self, robots: Mapping[str, Backdoor], host: str, port: int, token: str | None) -> None:
        """`robots` are the backdoors by the names of robots; the name of the only one may be empty."""
        self.robots, self.token = robots, token
        self.acceptor = Acceptor(host, port, self._serve)
        self._connections: dict[socket.socket, threading.Thread] = {}
        self.calls: set[Future[Any]] = set()  # that have not returned

    async def start(self) -> None:
        """Start listening. Raises ListenFault."""
        self.loop = asyncio.get_running_loop()
        await self.acceptor.start()

    async def close(self) -> None:
        """Stop listening, cancel calls, and end connections."""
        self.acceptor.close()
        for call in list(self.calls):
            call.cancel()
        for connection, thread in list(self._connections.items()):
            with contextlib.suppress(OSError):  # already gone
                connection.shutdown(socket.SHUT_RDWR)
            await asyncio.to_thread(thread.join, 1.0)  # a thread that outlives the robot keeps it in memory

    async def _serve(self, connection: socket.socket, peer: tuple[Any, ...]) -> None:
        if len(self._connections) >= MOST_CONNECTIONS:
            with contextlib.suppress(OSError), connection:
                connection.send(b"HTTP/1.1 503 too many connections\r\ncontent-length: 0\r\n\r\n")
            return

        def serve() -> None:
            gone = contextlib.suppress(OSError, CancelledError)  # the client, or the robot
            with gone, connection:
                _Handler(connection, peer, self)  # type: ignore[arg-type]  # it wants a socketserver
            del self._connections[connection]

        thread = threading.Thread(target=serve, name="iiwa-sim-backdoor", daemon=True)
        self._connections[connection] = thread
        thread.start()


class _Handler(BaseHTTPRequestHandler):
    """The requests of one connection, in a thread of its own."""

    protocol_version = default_request_version = "HTTP/1.1"
    timeout = IDLE_S
    wbufsize = -1
    disable_nagle_algorithm = True
    server: BackdoorHttp  # type: ignore[assignment]

    def do_GET(self) -> None:
        """Answer a call, by GET one that only reads."""
        try:
            result = self._result()
            answer = result if isinstance(result, bytes) else msgspec.json.encode(result) + b"\n"
            self._send(HTTPStatus.OK, answer)
        except Refused as refused:
            self._reject(refused)
        except (ConnectionError, TimeoutError, CancelledError):
            raise
        except Exception:
            logger.exception("internal error at %r", shortened(self.requestline, LONGEST_SHOWN))
            self._reject(NoCall(HTTPStatus.INTERNAL_SERVER_ERROR, "internal error, see the log"))

    do_POST = do_GET  # noqa: N815

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:  # noqa: ARG002
        """Answer a request that http.server does not understand."""
        self._reject(NoCall(HTTPStatus(code), message or HTTPStatus(code).phrase))

    def log_message(self, *_: object) -> None:
        """Log nothing: the client has the reply."""

    def _result(self) -> Any:
        """Make the call, and return its result."""
        body, url = self._body(), urlsplit(self.path)
        path = url.path.strip("/").split("/")
        self._admit(path)
        if path == [HEALTH]:
            return {"ok": True}
        if path == [""]:
            return {name: {"takes": call.takes, "does": call.summary} for name, call in CALLS.items()}
        query = dict(parse_qsl(url.query))
        if CAMERA in path[-2:-1]:
            query["name"] = unquote(path.pop())
        robots, name = self.server.robots, path.pop()
        robot = path.pop() if path else next(iter(robots)) if len(robots) == 1 else ""
        if path or robot not in robots:
            path_of = f"/ROBOT/{name}, with one of {', '.join(robots)}" if any(robots) else f"/{name}"
            raise NoCall(HTTPStatus.NOT_FOUND, f"there is no robot {robot!r}: expected {path_of}")
        if (call := CALLS.get(name)) is None:
            raise NoCall(HTTPStatus.NOT_FOUND, f"there is no call {name!r}: GET / lists all calls")
        if self.command == "GET" and not call.reads:
            raise NoCall(HTTPStatus.METHOD_NOT_ALLOWED, f"{name} is called by POST, not by GET")
        places = {str(place): field for place, field in enumerate(call.arguments.__struct_fields__)}
        try:
            given = query or msgspec.json.decode(body.strip() or b"{}", type=dict[str, Any])
            named = {places.get(key, key): value for key, value in given.items()}
            arguments = msgspec.convert(named, call.arguments, strict=not query)
        except (msgspec.MsgspecError, RecursionError) as fault:
            text = fault if isinstance(fault, msgspec.ValidationError) else "expected a JSON object"
            raise NoCall(HTTPStatus.BAD_REQUEST, f"{name}({', '.join(call.takes)}): {text}") from None

        async def called() -> Any:
            result = call.method(robots[robot], **msgspec.structs.asdict(arguments))
            return await result if inspect.isawaitable(result) else result

        if self.server.acceptor.listening is None:
            raise ConnectionAbortedError("the robot has gone")
        future = asyncio.run_coroutine_threadsafe(called(), self.server.loop)
        self.server.calls.add(future)
        future.add_done_callback(self.server.calls.discard)
        return future.result()

    def _body(self) -> bytes:
        length = self.headers.get("Content-Length") or "0"
        is_number = length.isascii() and length.isdigit() and len(length) < 10
        if "Transfer-Encoding" in self.headers or not is_number or int(length) > MOST_BYTES:
            reason = f"expected a Content-Length of at most {MOST_BYTES}"
            raise NoCall(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, reason)
        return self.rfile.read(int(length))

    def _admit(self, path: list[str]) -> None:
        token, headers = self.server.token, self.headers
        # A client with the token is no rebound page, whatever Host it names.
        hosts = headers.get_all("Host", []) if token is None else [LOCALHOST]
        reason = WebAccess().refusal(hosts, ())
        if "Origin" in headers:
            reason = f"a web page asks, of {headers['Origin']!r}: the backdoor is not for web pages"
        if reason is not None:
            raise NoCall(HTTPStatus.FORBIDDEN, reason)
        kind, _, word = headers.get("Authorization", "").partition(" ")
        known = token is None or (kind.lower() == "bearer" and fits(token, word.strip().encode()))
        if not known and path != [HEALTH]:
            raise NoCall(HTTPStatus.UNAUTHORIZED, "expected the header 'Authorization: Bearer TOKEN'")

    def _reject(self, refused: Refused) -> None:
        self.close_connection = self.close_connection or isinstance(refused, NoCall)
        error = msgspec.json.encode({"error": {"code": refused.code, "reason": refused.reason}}) + b"\n"
        self._send(refused.status if isinstance(refused, NoCall) else HTTPStatus.CONFLICT, error)

    def _send(self, status: HTTPStatus, body: bytes) -> None:
        self.send_response(status)
        is_picture = body.startswith(b"\x89PNG")
        self.send_header("Content-Type", "image/png" if is_picture else "application/json")
        self.send_header("Content-Length", str(len(body)))
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        self.wfile.write(body)
        self.wfile.flush()
