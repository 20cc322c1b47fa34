"""A viser server that only listens where it was told to, and only to whom it was told to."""

from __future__ import annotations

import asyncio
import contextlib
import io
import logging
import socket
import threading
import time
from collections.abc import Awaitable, Callable, Iterator
from http import HTTPStatus
from typing import Any

import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode
from websockets.http11 import Request, Response

from iiwa_sim.server.token import Token
from iiwa_sim.throttle import Throttle
from iiwa_sim.view.document import completed
from iiwa_sim.view.gate import (
    AT_ONCE,
    MESSAGES_PER_S,
    MOST_BYTES,
    Admitted,
    Denied,
    Gate,
    Rubbish,
    check_message,
)
from iiwa_sim.wording import harmless, shortened

TITLE = "iiwa-sim"
_SKY, _GROUND, _INTENSITY = (255, 255, 255), (150, 150, 155), 1.5
_LOOKED_AT = ("host", "origin", "cookie", "authorization")
_READY_LOOKS_S = 0.02
_TOLD_PER_S = 1
"""Lines in the log of what browsers do wrong; how many more there were is told after it."""

_BROKEN = (CloseCode.PROTOCOL_ERROR, CloseCode.INVALID_DATA, CloseCode.MESSAGE_TOO_BIG)

Handler = Callable[[ServerConnection], Awaitable[None]]

logger = logging.getLogger(__name__)


@contextlib.contextmanager
def open_page(listening: socket.socket, token: Token | None = None) -> Iterator[viser.ViserServer]:
    """A page at a socket that listens, until the context is left, which closes it.

    With a `token` browsers have to tell it. viser knows no such things: neither who asks, nor what a port
    that is taken means, nor what of a message is to be believed. It asks the library websockets for a server
    by the name of its module, so what is put there meanwhile gets between them.
    """
    real = websockets.asyncio.server.serve
    guard = _Guard(Gate(token), listening.getsockname()[1])

    def serve(handler: Handler, _host: str, _port: int, **options: Any) -> Any:
        options["process_request"] = guard.answering(options["process_request"])
        options["max_size"] = MOST_BYTES
        options["logger"] = guard.logger
        return real(guard.handling(handler), sock=listening, **options)

    # It prints a panel, at its end a word, and what it thinks of clients of other versions.
    with contextlib.redirect_stdout(io.StringIO()):
        websockets.asyncio.server.serve = serve  # type: ignore[assignment,misc]
        try:
            server = viser.ViserServer(host="127.0.0.1", port=0, label=TITLE, verbose=False)
        finally:
            websockets.asyncio.server.serve = real  # type: ignore[misc]
        guard.ready.set()
        server.request_share_url = _no_url  # type: ignore[assignment,method-assign]
        server.gui.configure_theme(show_logo=False, show_share_button=False, dark_mode=False)
        _light(server.scene)
        try:
            yield server
        finally:
            server.stop()


def _light(scene: viser.SceneApi) -> None:
    """Plain lights, no shadows, and nothing round it that the arm mirrors: where no GPU draws it, a frame
    takes a seventh of the time, and the arm looks much the same."""
    scene.configure_default_lights(cast_shadow=False)
    scene.configure_environment_map(None)
    scene.add_light_hemisphere("/light", sky_color=_SKY, ground_color=_GROUND, intensity=_INTENSITY)


def _no_url(_verbose: bool = True) -> None:
    """A link by which all the world could steer the robot: there is none."""


class _Guard:
    """A guard between the sockets and viser."""

    def __init__(self, gate: Gate, port: int) -> None:
        self._gate = gate
        self._port = port
        self.ready = threading.Event()
        """Whether viser is there altogether: it listens before, and fails at who comes then."""
        self._documents: dict[str, bytes] = {}  # by their encodings
        self._throttle = Throttle[str](_TOLD_PER_S, _told_more)
        self.logger = logging.Logger("websockets")  # noqa: LOG001 - it hands on to nobody but this
        self.logger.addFilter(self._from_library)

    def answering(
        self, inner: Callable[[ServerConnection, Request], Response | None]
    ) -> Callable[[ServerConnection, Request], Response | None]:
        """What answers requests: as `inner` does, where they are let in."""

        def answer(connection: ServerConnection, request: Request) -> Response | None:
            headers = {name: request.headers.get_all(name) for name in _LOOKED_AT}
            try:
                self._gate.check(request.path, headers, self._port)
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
            else:
                found = inner(connection, request)
                if found is None:
                    return None
                response = self._completed(found)
            response.headers["Content-Security-Policy"] = "frame-ancestors 'self'"
            response.headers["X-Content-Type-Options"] = "nosniff"
            response.headers["Referrer-Policy"] = "no-referrer"
            return response

        return answer

    def _completed(self, response: Response) -> Response:
        """The document completed, once in each encoding: it is the only file there is."""
        if response.status_code != HTTPStatus.OK:
            return response
        encoding = response.headers.get("Content-Encoding", "")
        if encoding not in self._documents:
            self._documents[encoding] = completed(bytes(response.body or b""), encoding, TITLE)
        response.body = self._documents[encoding]
        del response.headers["Content-Length"]
        response.headers["Content-Length"] = str(len(response.body))
        return response

    def handling(self, inner: Handler) -> Handler:
        """What serves a connection: as `inner` does, told only what is a message, and not too much of it."""

        async def handle(connection: ServerConnection) -> None:
            asyncio.get_running_loop().set_exception_handler(self._failed)
            connection.recv = self._receiving(connection)  # type: ignore[assignment,method-assign]
            while not self.ready.is_set():  # noqa: ASYNC110 - set in another thread
                await asyncio.sleep(_READY_LOOKS_S)
            try:
                await inner(connection)
            except ConnectionClosed:
                pass
            except Rubbish as rubbish:
                self._tell(f"{_peer(connection)} sends {rubbish}: the page lets it go")
            except Exception as fault:  # noqa: BLE001 - of viser, at whatever it was sent
                self._tell(f"{_peer(connection)} dropped: {_shown(fault)}")
            sent = connection.protocol.close_sent
            if sent is not None and sent.code in _BROKEN:
                self._tell(f"{_peer(connection)} dropped: {sent}")

        return handle

    def _receiving(self, connection: ServerConnection) -> Callable[..., Awaitable[bytes]]:
        receive = connection.recv
        allowance, since_s, told = float(AT_ONCE), time.monotonic(), False

        async def recv(*_: Any, **__: Any) -> bytes:
            nonlocal allowance, since_s, told
            while True:
                raw = await receive()
                now_s = time.monotonic()
                allowance = min(allowance + (now_s - since_s) * MESSAGES_PER_S, AT_ONCE) - 1.0
                since_s = now_s
                if allowance < 0.0:
                    if not told:
                        told = True
                        flood = f"more than {MESSAGES_PER_S:.0f} messages a second, which wait"
                        self._tell(f"{_peer(connection)} sends {flood}")
                    await asyncio.sleep(-allowance / MESSAGES_PER_S)
                if check_message(raw):
                    assert isinstance(raw, bytes)
                    return raw

        return recv

    def _failed(self, _loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """What viser made of a message was no success; asyncio would tell it with a traceback."""
        fault = context.get("exception")
        self._tell(f"a browser's message failed: {_shown(fault) if fault else context.get('message', '')}")

    def _from_library(self, record: logging.LogRecord) -> bool:
        if record.levelno >= logging.WARNING:
            fault = record.exc_info[1] if record.exc_info else None
            self._tell(f"{record.getMessage()}{f': {_shown(fault)}' if fault else ''}")
        return False

    def _tell(self, what: str) -> None:
        if self._throttle.count("page", time.monotonic_ns()) is not None:
            logger.warning("page: %s", shortened(harmless(what), 300))


def _told_more(_kind: str, untold: int) -> None:
    logger.warning("page: %d more like that within a second", untold)


def _shown(fault: BaseException) -> str:
    return f"{type(fault).__name__} {fault}".rstrip()


def _peer(connection: ServerConnection) -> str:
    peer = connection.remote_address
    return f"{peer[0]}:{peer[1]}" if peer else "a browser already gone"
