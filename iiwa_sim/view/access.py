"""A viser server behind checks: who may open the page, and the messages that a browser may send.

viser admits everybody and sets the attributes that a message names. Each request and each message passes here
first.
"""

from __future__ import annotations

import asyncio
import contextlib
import gzip
import io
import logging
import secrets
import socket
import threading
import time
import warnings
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

import msgspec
import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from iiwa_sim.server.token import Token
from iiwa_sim.server.web_access import LOCALHOST, WebAccess
from iiwa_sim.throttle import Throttle
from iiwa_sim.wording import harmless, shortened

MOST_BYTES = 65_536
"""Longest message from a browser."""
MESSAGES_PER_S, AT_ONCE = 200.0, 200
"""Rate of messages beyond which they wait. A browser sends some 60 per second while the mouse is dragged."""
ALLOWED = frozenset(
    {
        "CommandTriggerMessage",
        "GuiButtonHoldMessage",
        "GuiFormDirtyMessage",
        "GuiFormSubmitMessage",
        "GuiUpdateMessage",
        "SceneNodeClickMessage",
        "SceneNodeDragMessage",
        "ViewerCameraMessage",
    }
)
"""Kinds of messages that reach viser. ShareUrlRequest would open the page to the internet."""
READY_S = 0.02
"""Period of the check whether viser has started."""
_HEADERS = ("host", "origin", "cookie", "authorization")
_FORM = """<!doctype html><html lang="en"><meta charset="utf-8">
<meta name="viewport" content="width=device-width"><title>iiwa-sim</title>
<style>body{font:16px sans-serif;margin:20vh auto;max-width:20em}</style>
<form method="get" action="/"><p>This robot's page asks for its token.</p>
<p><input type="password" name="token" autofocus autocomplete="current-password"> <button>Open</button></p>
<p>%s</p></form></html>
"""
# viser's hotkeys do not work in text fields, and Ctrl-E also moves the camera. So the key is sent again from
# outside of the field, and hidden from the camera.
_HEAD = """<title>iiwa-sim</title>
<style>[role="tab"] { padding-inline: 0.6em !important; font-size: 0.85em !important; }</style>
<script>
  const stops = event =>
    (event.ctrlKey || event.metaKey) && !event.altKey && !event.shiftKey && event.key.toLowerCase() === "e";
  addEventListener("keydown", event => {
    if (!stops(event)) return;
    event.preventDefault();
    if (!(event.target instanceof Element && event.target.closest("input, textarea, select"))) return;
    event.stopImmediatePropagation();
    document.body.dispatchEvent(new KeyboardEvent("keydown", { key: event.key, code: event.code,
      ctrlKey: event.ctrlKey, metaKey: event.metaKey, bubbles: true, cancelable: true }));
  }, true);
  document.documentElement.addEventListener("keydown",
    event => { if (stops(event)) event.stopPropagation(); });
</script>
"""

Handler = Callable[[ServerConnection], Awaitable[None]]

logger = logging.getLogger(__name__)


class Rubbish(Exception):
    """A message that no browser sends."""


class Denied(Exception):
    """A request that is rejected."""

    def __init__(self, status: HTTPStatus, reason: str, page: str = "") -> None:
        super().__init__(reason)
        self.status = status
        self.page = page
        """HTML for the browser; the reason as text if empty."""


class Admitted(Exception):
    """A request with the token: the reply sets a cookie and leads to the page."""

    def __init__(self, cookie: str) -> None:
        super().__init__()
        self.cookie = cookie


class Gate:
    """Checks of requests: Host and Origin, and the token if there is one.

    A browser sends the token once, in a form, and has a cookie from then on, valid while this process runs.
    Other clients send `Authorization: Bearer TOKEN`.
    """

    def __init__(self, token: Token | None) -> None:
        self._token = token
        self._access = WebAccess()
        self._key = secrets.token_urlsafe(32)

    def check(self, path: str, headers: Mapping[str, Sequence[str]], port: int) -> None:
        """Raises Denied or Admitted. The name of the cookie has the `port`: cookies are one machine's."""
        hosts = headers["host"]
        reason = self._access.refusal(hosts if self._token is None else [LOCALHOST], ())
        if reason is None and len(hosts) != 1:
            reason = f"{len(hosts)} headers Host: expected one"
        for origin in headers["origin"] if reason is None else ():
            if origin.partition("://")[2].lower() != hosts[0].lower():
                reason = f"a page of '{shortened(harmless(origin), 100)}' asks, not one of ours"
        if reason is not None:
            raise Denied(HTTPStatus.FORBIDDEN, reason)
        if self._token is not None:
            self._check_token(self._token, path, headers, f"iiwa-sim-{port}")

    def _check_token(self, token: Token, path: str, headers: Mapping[str, Sequence[str]], name: str) -> None:
        cookies = SimpleCookie()
        with contextlib.suppress(CookieError):
            cookies.load("; ".join(headers["cookie"]))
        if name in cookies and secrets.compare_digest(cookies[name].value.encode(), self._key.encode()):
            return
        for header in headers["authorization"]:
            kind, _, word = header.partition(" ")
            if kind.lower() == "bearer" and token.fits(word.strip().encode()):
                return
        words = parse_qs(urlsplit(path).query, max_num_fields=8).get("token", [])
        if words and token.fits(words[0].strip().encode()):
            raise Admitted(f"{name}={self._key}; Path=/; HttpOnly; SameSite=Strict")
        page = _FORM % ("This is not the token." if words else "")
        raise Denied(HTTPStatus.UNAUTHORIZED, "it has not told the token", page)


def check_message(raw: str | bytes) -> bool:
    """Return True for a message that viser should get. Raises Rubbish."""
    if not isinstance(raw, bytes):
        raise Rubbish("text")
    try:
        message = msgspec.msgpack.decode(raw)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError):
        raise Rubbish("bytes that are no message") from None
    if not isinstance(message, dict) or not isinstance(message.get("type"), str):
        raise Rubbish("a message without a type")
    if message["type"] == "GuiUpdateMessage":
        updates = message.get("updates")
        if not isinstance(updates, dict) or set(updates) != {"value"}:  # viser sets any attribute
            raise Rubbish(f"an update of {shortened(harmless(str(updates)), 60)}")
    return message["type"] in ALLOWED


@contextlib.contextmanager
def open_page(listening: socket.socket, token: Token | None = None) -> Iterator[viser.ViserServer]:
    """Serve a page at a socket that listens, until the context ends.

    viser asks the module websockets for its server; a replacement there, meanwhile, gets between the two.
    """
    real = websockets.asyncio.server.serve
    guard = _Guard(Gate(token), listening.getsockname()[1])

    def serve(handler: Handler, _host: str, _port: int, **options: Any) -> Any:
        options["process_request"] = guard.answering(options["process_request"])
        options["max_size"] = MOST_BYTES
        options["logger"] = guard.logger
        return real(guard.handling(handler), sock=listening, **options)

    # A browser that leaves while its camera is set is no fault.
    warnings.filterwarnings("ignore", "Queued a .* on a closed connection", UserWarning)
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints
        websockets.asyncio.server.serve = serve  # type: ignore[assignment,misc]
        try:
            server = viser.ViserServer(host="127.0.0.1", port=0, label="iiwa-sim", verbose=False)
        finally:
            websockets.asyncio.server.serve = real  # type: ignore[misc]
        guard.ready.set()
        server.request_share_url = lambda *_, **__: None  # type: ignore[method-assign]
        server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
        # Without shadows and reflections a frame takes a seventh of the time on a machine without a GPU.
        server.scene.configure_default_lights(cast_shadow=False)
        server.scene.configure_environment_map(None)
        sky: dict[str, Any] = {
            "sky_color": (255, 255, 255),
            "ground_color": (150, 150, 155),
            "intensity": 1.5,
        }
        server.scene.add_light_hemisphere("/light", **sky)
        try:
            yield server
        finally:
            server.stop()


class _Guard:
    """Checks between the sockets and viser."""

    def __init__(self, gate: Gate, port: int) -> None:
        self._gate = gate
        self._port = port
        self.ready = threading.Event()
        """Set when viser has started; it listens before, and fails at connections then."""
        self._throttle = Throttle[str](
            1, lambda _, untold: logger.warning("page: %d more like that within a second", untold)
        )
        self.logger = logging.Logger("websockets")  # noqa: LOG001 - it hands on to nobody but this
        self.logger.addFilter(self._from_library)

    def answering(
        self, inner: Callable[[ServerConnection, Request], Response | None]
    ) -> Callable[[ServerConnection, Request], Response | None]:
        """Return a function that replies to admitted requests as `inner` does."""

        def answer(connection: ServerConnection, request: Request) -> Response | None:
            headers = {name: request.headers.get_all(name) for name in _HEADERS}
            try:
                self._gate.check(request.path, headers, self._port)
                response = inner(connection, request)
                if response is None:
                    return None
                _complete(response)
            except Denied as denied:
                self._tell(f"{_peer(connection)}: {denied}")
                response = connection.respond(denied.status, denied.page or f"{denied}\n")
                if denied.page:
                    del response.headers["Content-Type"]
                    response.headers["Content-Type"] = "text/html; charset=utf-8"
            except Admitted as admitted:
                response = connection.respond(HTTPStatus.SEE_OTHER, "")
                response.headers["Location"] = "/"
                response.headers["Set-Cookie"] = admitted.cookie
            response.headers["Content-Security-Policy"] = "frame-ancestors 'self'"
            response.headers["X-Content-Type-Options"] = "nosniff"
            response.headers["Referrer-Policy"] = "no-referrer"
            return response

        return answer

    def handling(self, inner: Handler) -> Handler:
        """Return a handler that gives `inner` the messages that pass, at most `MESSAGES_PER_S`."""

        async def handle(connection: ServerConnection) -> None:
            asyncio.get_running_loop().set_exception_handler(self._failed)
            connection.recv = self._receiving(connection)  # type: ignore[assignment,method-assign]
            while not self.ready.is_set():  # noqa: ASYNC110 - set in another thread
                await asyncio.sleep(READY_S)
            try:
                await inner(connection)
            except ConnectionClosed:
                pass
            except Rubbish as rubbish:
                self._tell(f"{_peer(connection)} sends {rubbish}: its connection is closed")
            except Exception as fault:  # noqa: BLE001 - of viser, at any message
                self._tell(f"{_peer(connection)} dropped: {type(fault).__name__} {fault}")
            sent = connection.protocol.close_sent
            if sent is not None and sent.code in (1002, 1007, 1009):  # of websockets, at a broken message
                self._tell(f"{_peer(connection)} dropped: {sent}")

        return handle

    def _receiving(self, connection: ServerConnection) -> Callable[..., Awaitable[bytes]]:
        receive = connection.recv
        allowance, since_s, flooded = float(AT_ONCE), time.monotonic(), False

        async def recv(*_: Any, **__: Any) -> bytes:
            nonlocal allowance, since_s, flooded
            while True:
                raw = await receive()
                now_s = time.monotonic()
                allowance = min(allowance + (now_s - since_s) * MESSAGES_PER_S, AT_ONCE) - 1.0
                since_s = now_s
                if allowance < 0.0:
                    if not flooded:
                        flooded = True
                        self._tell(
                            f"{_peer(connection)} sends more than {MESSAGES_PER_S:.0f} messages a second"
                        )
                    await asyncio.sleep(-allowance / MESSAGES_PER_S)
                if check_message(raw):
                    assert isinstance(raw, bytes)
                    return raw

        return recv

    def _failed(self, _loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        fault = context.get("exception")
        self._tell(f"a browser's message failed: {fault!r}" if fault else context.get("message", ""))

    def _from_library(self, record: logging.LogRecord) -> bool:
        if record.levelno >= logging.WARNING:
            fault = record.exc_info[1] if record.exc_info else None
            self._tell(f"{record.getMessage()}{f': {fault!r}' if fault else ''}")
        return False

    def _tell(self, text: str) -> None:
        if self._throttle.count("page", time.monotonic_ns()) is not None:
            logger.warning("page: %s", shortened(harmless(text), 300))


def _complete(response: Response) -> None:
    """Put our title and script into viser's document."""
    if response.status_code == HTTPStatus.OK:
        packed, body = response.headers.get("Content-Encoding") == "gzip", bytes(response.body or b"")
        text = gzip.decompress(body) if packed else body
        text = text.replace(b"<title>Viser</title>", _HEAD.encode(), 1)
        response.body = gzip.compress(text, 5) if packed else text
        del response.headers["Content-Length"]
        response.headers["Content-Length"] = str(len(response.body))


def _peer(connection: ServerConnection) -> str:
    peer = connection.remote_address
    return f"{peer[0]}:{peer[1]}" if peer else "a browser already gone"
