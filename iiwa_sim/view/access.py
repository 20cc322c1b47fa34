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
from collections.abc import Iterator
from http import HTTPStatus
from typing import Any
from urllib.parse import parse_qs, urlsplit

import msgspec
import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from iiwa_sim.log import Throttle
from iiwa_sim.server.token import Token
from iiwa_sim.server.web_access import WebAccess
from iiwa_sim.wording import harmless, shortened

MOST_BYTES = 65_536
"""Longest message from a browser."""
ALLOWED = frozenset(
    [
        "GuiButtonHoldMessage",
        "GuiFormDirtyMessage",
        "GuiFormSubmitMessage",
        "GuiUpdateMessage",
        "SceneNodeClickMessage",
        "SceneNodeDragMessage",
        "ViewerCameraMessage",
    ]
)
"""Kinds of messages that reach viser. ShareUrlRequest would open the page to the internet."""
READY_S = 0.02
"""Period of the check whether the page is built."""
HEADERS = {
    "Content-Security-Policy": "frame-ancestors 'self'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}
ASK = "this page asks for its token: open http://HOST:PORT/?token=TOKEN once\n"
_HEAD = b"""<title>iiwa-sim</title>
<style>[role="tab"] { padding-inline: 0.6em !important; font-size: 0.85em !important; }</style>"""

logger = logging.getLogger(__name__)


@contextlib.contextmanager
def open_page(
    listening: socket.socket, token: Token | None = None
) -> Iterator[tuple[viser.ViserServer, threading.Event]]:
    """Serve a page at a socket that listens, until the context ends. Browsers wait for the event.

    viser asks the module websockets for its server; a replacement there, meanwhile, gets between the two.
    """
    real, gate = websockets.asyncio.server.serve, _Gate(token, listening.getsockname()[1])
    quiet = logging.Logger("websockets")  # noqa: LOG001 - the gate tells what matters
    quiet.disabled = True

    def serve(handler: Any, _host: str, _port: int, **options: Any) -> Any:
        inner = options["process_request"]

        def answer(connection: ServerConnection, request: Request) -> Response | None:
            response = gate.refusal(connection, request)
            if response is None:
                response = inner(connection, request)
                if response is not None and response.status_code == HTTPStatus.OK:
                    _complete(response)
            if response is not None:
                response.headers.update(HEADERS)
            return response

        options |= {"process_request": answer, "max_size": MOST_BYTES, "logger": quiet}
        return real(gate.guarded(handler), sock=listening, **options)

    # A browser that leaves while its camera is set is no fault.
    warnings.filterwarnings("ignore", "Queued a .* on a closed connection", UserWarning)
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints
        websockets.asyncio.server.serve = serve  # type: ignore[assignment,misc]
        try:
            server = viser.ViserServer(host="127.0.0.1", port=0, label="iiwa-sim", verbose=False)
        finally:
            websockets.asyncio.server.serve = real  # type: ignore[misc]
        server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
        # Without shadows and reflections a frame takes a seventh of the time on a machine without a GPU.
        server.scene.configure_default_lights(cast_shadow=False)
        server.scene.configure_environment_map(None)
        colours: dict[str, Any] = {"sky_color": (255, 255, 255), "ground_color": (150, 150, 155)}
        server.scene.add_light_hemisphere("/light", intensity=1.5, **colours)
        try:
            yield server, gate.ready
        finally:
            server.stop()


class _Gate:
    """Checks between the sockets and viser: Host and Origin, the token if there is one, and messages.

    A browser sends the token once, in the address, and has a cookie from then on, valid while this process
    runs.
    """

    def __init__(self, token: Token | None, port: int) -> None:
        self._token = token
        self._cookie = f"iiwa-sim-{port}={secrets.token_urlsafe(32)}"  # cookies are one machine's
        self._access, self._throttle = WebAccess(), Throttle(1)
        self.ready = threading.Event()
        """Set when the page is built; viser listens before."""

    def refusal(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the reply to a request that is not admitted, or that sends the token."""
        hosts, origins = (request.headers.get_all(name) for name in ("Host", "Origin"))
        reason = self._access.refusal(hosts, ()) if self._token is None else None
        if any(each.lower().partition("://")[2] not in map(str.lower, hosts) for each in origins):
            reason = f"a page of '{shortened(harmless(origins[0]), 100)}' asks, not one of ours"
        if reason is not None:
            self._tell(connection, reason)
            return connection.respond(HTTPStatus.FORBIDDEN, f"{reason}\n")
        cookies = [each.strip() for line in request.headers.get_all("Cookie") for each in line.split(";")]
        if self._token is None or any(
            secrets.compare_digest(each.encode(), self._cookie.encode()) for each in cookies
        ):
            return None
        words = parse_qs(urlsplit(request.path).query, max_num_fields=8).get("token", [""])
        if self._token.fits(words[0].encode()):
            response = connection.respond(HTTPStatus.SEE_OTHER, "")
            response.headers["Location"] = "/"
            response.headers["Set-Cookie"] = f"{self._cookie}; Path=/; HttpOnly; SameSite=Strict"
            return response
        self._tell(connection, "it has not told the token")
        return connection.respond(HTTPStatus.UNAUTHORIZED, ASK)

    def guarded(self, inner: Any) -> Any:
        """Return a handler that gives `inner` the messages that pass."""

        async def handle(connection: ServerConnection) -> None:
            receive = connection.recv

            async def recv(*_: Any, **__: Any) -> str | bytes:
                while not is_allowed(raw := await receive()):
                    pass
                return raw

            connection.recv = recv  # type: ignore[assignment,method-assign]
            while not self.ready.is_set():  # noqa: ASYNC110 - set in another thread
                await asyncio.sleep(READY_S)
            try:
                await inner(connection)
            except ConnectionClosed:
                pass
            except Exception as fault:  # noqa: BLE001 - of viser, at any message
                self._tell(connection, f"dropped: {type(fault).__name__} {fault}")

        return handle

    def _tell(self, connection: ServerConnection, text: str) -> None:
        if self._throttle.count("page", time.monotonic_ns()) is not None:
            host, port, *_ = connection.remote_address or ("a browser", "gone")
            logger.warning("page: %s:%s: %s", host, port, shortened(harmless(text), 300))


def is_allowed(raw: str | bytes) -> bool:
    """Return True for a message that viser should get. Raises ValueError for what no browser sends."""
    message = msgspec.msgpack.decode(raw if isinstance(raw, bytes) else raw.encode(), type=dict[str, Any])
    if message.get("type") == "GuiUpdateMessage" and set(message["updates"]) != {"value"}:
        raise ValueError("an update of more than a value")  # viser sets any attribute
    return message.get("type") in ALLOWED


def _complete(response: Response) -> None:
    """Put our title and looks into viser's document."""
    packed, body = response.headers.get("Content-Encoding") == "gzip", bytes(response.body or b"")
    text = (gzip.decompress(body) if packed else body).replace(b"<title>Viser</title>", _HEAD, 1)
    response.body = gzip.compress(text, 5) if packed else text
    del response.headers["Content-Length"]
    response.headers["Content-Length"] = str(len(response.body))
