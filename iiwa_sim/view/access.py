"""A viser server with access checks; viser by itself admits all browsers."""

from __future__ import annotations

import asyncio
import contextlib
import io
import logging
import secrets
import socket
import threading
import warnings
from collections.abc import Callable, Iterator
from http import HTTPStatus
from typing import Any
from urllib.parse import parse_qs, urlsplit

import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from iiwa_sim.server.token import fits
from iiwa_sim.server.web_access import WebAccess

MOST_BYTES = 65_536
"""Longest message from a browser."""
READY_S = 0.02
"""Period of the check whether the page is built."""
ASK = "this page asks for its token: open http://HOST:PORT/?token=TOKEN once\n"


@contextlib.contextmanager
def open_page(
    listening: socket.socket, token: str | None = None
) -> Iterator[tuple[viser.ViserServer, threading.Event]]:
    """Serve a page at a socket that listens, until the context ends. Browsers wait for the event.

    viser asks the module websockets for its server; a replacement there, meanwhile, gets between the two.
    """
    real, ready = websockets.asyncio.server.serve, threading.Event()
    refusal = _gate(token, listening.getsockname()[1])
    quiet = logging.Logger("websockets")  # noqa: LOG001 - of browsers that leave, or send rubbish
    quiet.disabled = True

    def serve(handler: Any, _host: str, _port: int, **options: Any) -> Any:
        inner = options["process_request"]

        async def answer(connection: ServerConnection, request: Request) -> Response | None:
            response = refusal(connection, request) or inner(connection, request)
            if response is not None:
                response.headers["Content-Security-Policy"] = "frame-ancestors 'self'"
            while response is None and not ready.is_set():  # noqa: ASYNC110 - set in another thread
                await asyncio.sleep(READY_S)
            return response

        options |= {"process_request": answer, "max_size": MOST_BYTES, "logger": quiet}
        return real(handler, sock=listening, **options)

    # A browser that leaves while its camera is set is no fault.
    warnings.filterwarnings("ignore", "Queued a .* on a closed connection", UserWarning)
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints
        websockets.asyncio.server.serve = serve  # type: ignore[assignment,misc]
        try:
            server = viser.ViserServer(host="127.0.0.1", port=0, label="iiwa-sim", verbose=False)
        finally:
            websockets.asyncio.server.serve = real  # type: ignore[misc]
        server.request_share_url = lambda *_: None  # type: ignore[method-assign]  # opens it to the internet
        server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
        # Without shadows and reflections a frame takes a seventh of the time on a machine without a GPU.
        server.scene.configure_default_lights(cast_shadow=False)
        server.scene.configure_environment_map(None)
        colours: dict[str, Any] = {"sky_color": (255, 255, 255), "ground_color": (150, 150, 155)}
        server.scene.add_light_hemisphere("/light", intensity=1.5, **colours)
        try:
            yield server, ready
        finally:
            server.stop()


def _gate(token: str | None, port: int) -> Callable[[ServerConnection, Request], Response | None]:
    """Return a function that answers a request that is not admitted, or that sends the token.

    A browser sends the token once, in the address, and has a cookie from then on, valid while this process
    runs.
    """
    cookie = f"iiwa-sim-{port}={secrets.token_urlsafe(32)}"  # cookies are one machine's, whatever the port

    def refusal(connection: ServerConnection, request: Request) -> Response | None:
        hosts, origins, cookies = (request.headers.get_all(name) for name in ("Host", "Origin", "Cookie"))
        reason = WebAccess().refusal(hosts, ()) if token is None else None
        if any(each.lower().partition("://")[2] not in map(str.lower, hosts) for each in origins):
            reason = "a page of another site asks"
        if reason is not None:
            return connection.respond(HTTPStatus.FORBIDDEN, f"{reason}\n")
        if token is None or any(fits(cookie, each.strip().encode()) for each in ";".join(cookies).split(";")):
            return None
        words = parse_qs(urlsplit(request.path).query).get("token", [""])
        if not fits(token, words[0].encode()):
            return connection.respond(HTTPStatus.UNAUTHORIZED, ASK)
        response = connection.respond(HTTPStatus.SEE_OTHER, "")
        response.headers["Location"] = "/"
        response.headers["Set-Cookie"] = f"{cookie}; Path=/; HttpOnly; SameSite=Strict"
        return response

    return refusal
