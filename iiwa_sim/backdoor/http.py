"""The backdoor over HTTP: `POST /METHOD` calls a method of `Backdoor` with a JSON object of its arguments.

Of several robots, `POST /ROBOT/METHOD` calls that of one. The calls and their parameters come from the
signatures of `Backdoor`.
"""

import asyncio
import contextlib
import http.client
import inspect
import socket
from collections.abc import Awaitable, Callable, Mapping
from difflib import get_close_matches
from email.message import Message
from http import HTTPStatus
from io import BytesIO
from typing import Any, NamedTuple, get_type_hints
from urllib.parse import parse_qsl, unquote

import msgspec

from iiwa_sim.backdoor.backdoor import CLIENT, Backdoor
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, EXECUTION, Refused
from iiwa_sim.log import SessionLog
from iiwa_sim.server.listening import Acceptor, host_and_port
from iiwa_sim.server.token import Token
from iiwa_sim.server.web_access import LOCALHOST, WebAccess
from iiwa_sim.wording import harmless, shortened

HEALTH = "healthz"
CAMERA = "camera"
MOST_BYTES = 65_536
"""Largest body, and largest head."""
IDLE_S = 60.0
"""Time (s) after which a connection without a request is closed."""
LOOKS_S = 0.25
"""Time (s) between two looks for a client that does not wait any more."""
_LONGEST_SHOWN = 200
_GONE = (ConnectionError, TimeoutError, asyncio.IncompleteReadError, asyncio.LimitOverrunError)
"""Faults of a connection: the client has gone, is idle or sends a head without an end."""
_INTERNAL = "internal error, see the log"


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
    fields = [
        (each.name, types[each.name], *(() if each.default is each.empty else (each.default,)))
        for each in parameters
    ]
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
        super().__init__(COMMUNICATION_FAILURE, harmless(reason))
        self.status = status


class BackdoorHttp:
    """Serves a backdoor on `host`:`port` from `start` to `close`; port 0 picks a free one.

    With a `token`, requests have to carry it (`Authorization: Bearer TOKEN`), except for `/healthz`. Web
    pages are rejected: a browser names the page in the header Origin, and a rebound host name shows in Host.
    """

    def __init__(
        self,
        robots: Mapping[str, Backdoor],
        log: SessionLog,
        host: str,
        port: int,
        token: Token | None = None,
    ) -> None:
        """`robots` are the backdoors by the names of robots; the name of the only one may be empty."""
        self._robots = robots
        self._log = log
        self._token = token
        self.acceptor = Acceptor(host, port, self._serve)
        self._connections: set[asyncio.Task[None]] = set()

    async def start(self) -> None:
        """Start listening. Raises ListenFault."""
        await self.acceptor.start()

    async def close(self) -> None:
        """Stop listening, and end connections with their pending calls."""
        self.acceptor.close()
        for connection in self._connections:
            connection.cancel()
        await asyncio.gather(*self._connections, return_exceptions=True)

    async def _serve(self, connection: socket.socket, peer: tuple[Any, ...]) -> None:
        reader, writer = await asyncio.open_connection(sock=connection, limit=MOST_BYTES)
        client = f"{host_and_port(*peer[:2])} (backdoor)"
        task = asyncio.create_task(self._converse(reader, writer, client))
        self._connections.add(task)
        task.add_done_callback(self._connections.discard)

    async def _converse(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, client: str
    ) -> None:
        """Answer requests until the client goes, is idle, or is rejected."""
        CLIENT.set(client)
        with contextlib.closing(writer), contextlib.suppress(*_GONE):
            keeps = True
            while keeps and (head := await _head_from(reader)):
                line, _, headers = head.partition(b"\r\n")
                shown = harmless(shortened(line.decode("latin-1"), _LONGEST_SHOWN))
                keeps, status = False, HTTPStatus.OK
                try:
                    method, target, version, parsed = _parsed(line.decode("latin-1"), headers)
                    async with asyncio.timeout(IDLE_S):
                        body = await reader.readexactly(_length(parsed))
                    self._admit(parsed, target)
                    result = self._called(method, target, body)
                    if inspect.isawaitable(result):
                        result = await _unless_gone(result, reader)
                    answer = result if isinstance(result, bytes) else msgspec.json.encode(result) + b"\n"
                    keeps = version == "HTTP/1.1" and parsed.get("Connection", "").lower() != "close"
                    if self._log.wants_commands():
                        said = shortened(answer.decode("ascii", "replace"), _LONGEST_SHOWN)
                        self._log.command(client, shown, said)
                except _GONE:
                    raise
                except Exception as fault:  # noqa: BLE001 - answered
                    refused = fault if isinstance(fault, Refused) else Refused(EXECUTION, _INTERNAL)
                    if refused is not fault:
                        self._log.exception(client, shown, fault)
                    self._log.refused(client, shown, refused.code, refused.reason)
                    status = getattr(refused, "status", HTTPStatus.CONFLICT)
                    error = {"code": refused.code, "reason": refused.reason}
                    answer = msgspec.json.encode({"error": error}) + b"\n"
                writer.write(_response(status, answer, keeps))
                await writer.drain()
                await asyncio.sleep(0)  # for others, where the next request is there already

    def _called(self, method: str, target: str, body: bytes) -> Any:
        """Make a call, and return its result. Raises Refused."""
        place, _, values = target.partition("?")
        path, query = place.strip("/").split("/"), dict(parse_qsl(values))
        if path == [HEALTH]:
            return {"ok": True}
        if path == [""]:
            return _listing()
        if CAMERA in path[-2:-1]:
            query["name"] = unquote(path.pop())
        robots, name = self._robots, path.pop()
        robot = path.pop() if path else next(iter(robots)) if len(robots) == 1 else ""
        if path or robot not in robots:
            there_are = ", ".join(filter(None, robots)) or "one without a name"
            reason = f"there is no robot {_shown(robot)}: expected /ROBOT/{name}, with one of {there_are}"
            raise NoCall(HTTPStatus.NOT_FOUND, reason)
        call = CALLS.get(name)
        if call is None:
            near = get_close_matches(name.replace("-", "_"), CALLS, 1)
            hint = f"did you mean {near[0]}?" if near else "GET / lists all calls"
            raise NoCall(HTTPStatus.NOT_FOUND, f"there is no call {_shown(name)}: {hint}")
        if method == "GET" and not call.reads:
            raise NoCall(HTTPStatus.METHOD_NOT_ALLOWED, f"{name} is called by POST, not by GET")
        try:
            if query:
                arguments = msgspec.convert(query, call.arguments, strict=False)
            else:
                arguments = msgspec.json.decode(body.strip() or b"{}", type=call.arguments)
        except (msgspec.MsgspecError, RecursionError) as fault:
            reason = f"{name}({', '.join(call.takes)}): {fault}"
            raise NoCall(HTTPStatus.BAD_REQUEST, reason) from None
        return call.method(robots[robot], **msgspec.structs.asdict(arguments))

    def _admit(self, headers: Message, target: str) -> None:
        token = self._token
        # A client with the token is no rebound page, whatever Host it names.
        hosts = headers.get_all("Host", []) if token is None else [LOCALHOST]
        reason = WebAccess().refusal(hosts, ())
        if reason is None and "Origin" in headers:
            reason = f"a web page asks, of {_shown(headers['Origin'])}: the backdoor is not for web pages"
        if reason is not None:
            raise NoCall(HTTPStatus.FORBIDDEN, reason)
        kind, _, word = headers.get("Authorization", "").partition(" ")
        known = token is None or (kind.lower() == "bearer" and token.fits(word.strip().encode()))
        if not known and target.strip("/") != HEALTH:
            raise NoCall(HTTPStatus.UNAUTHORIZED, "expected the header 'Authorization: Bearer TOKEN'")


async def _head_from(reader: asyncio.StreamReader) -> bytes:
    """Return request line and headers; an incomplete one at the end of the stream."""
    async with asyncio.timeout(IDLE_S):
        try:
            return await reader.readuntil(b"\r\n\r\n")
        except asyncio.IncompleteReadError as end:
            return end.partial


def _parsed(line: str, headers: bytes) -> tuple[str, str, str, Message]:
    """Return method, target, version and headers of a request. Raises NoCall."""
    words = line.split(" ")
    if len(words) != 3 or not words[2].startswith("HTTP/1."):
        raise NoCall(HTTPStatus.BAD_REQUEST, "expected a request of HTTP/1.1")
    if words[0] not in ("GET", "POST"):
        raise NoCall(HTTPStatus.NOT_IMPLEMENTED, "expected GET or POST")
    try:
        return words[0], words[1], words[2], http.client.parse_headers(BytesIO(headers))
    except http.client.HTTPException as fault:
        raise NoCall(HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE, str(fault)) from None


def _length(headers: Message) -> int:
    """Return the length of a body. Raises NoCall."""
    length = headers.get("Content-Length") or "0"
    if "Transfer-Encoding" in headers or not (length.isascii() and length.isdigit()):
        raise NoCall(HTTPStatus.LENGTH_REQUIRED, "expected a body with a Content-Length")
    if len(length) > 9 or int(length) > MOST_BYTES:
        reason = f"a body of {length[:20]} bytes: expected at most {MOST_BYTES}"
        raise NoCall(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, reason)
    return int(length)


async def _unless_gone(call: Awaitable[Any], reader: asyncio.StreamReader) -> Any:
    """Return the result of a call; cancel it if the client goes, and raise ConnectionResetError."""
    task = asyncio.ensure_future(call)
    try:
        while not (await asyncio.wait([task], timeout=LOOKS_S))[0]:
            if reader.at_eof() or reader.exception():
                raise ConnectionResetError
        return task.result()
    finally:
        task.cancel()


def _response(status: HTTPStatus, body: bytes, keeps: bool) -> bytes:
    kind = "image/png" if body.startswith(b"\x89PNG") else "application/json"
    head = [
        f"HTTP/1.1 {status.value} {status.phrase}",
        f"Content-Type: {kind}",
        f"Content-Length: {len(body)}",
    ]
    if status is HTTPStatus.UNAUTHORIZED:
        head.append("WWW-Authenticate: Bearer")
    if not keeps:
        head.append("Connection: close")
    return "\r\n".join([*head, "", ""]).encode() + body


def _listing() -> bytes:
    """Return all calls in JSON, one in a line."""
    calls = {
        name: {"by": "GET, POST" if call.reads else "POST", "takes": call.takes, "does": call.summary}
        for name, call in CALLS.items()
    }
    return b"{\n" + b",\n".join(msgspec.json.encode({k: v})[1:-1] for k, v in calls.items()) + b"\n}\n"


def _shown(text: str) -> str:
    return repr(shortened(harmless(text), 40))
