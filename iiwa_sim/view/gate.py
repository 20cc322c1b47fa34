"""Who may open the page, and what a browser may say to it.

viser lets in everybody, and believes what it is sent. So each request and each message passes here before.
"""

from __future__ import annotations

import re
import secrets
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING
from urllib.parse import parse_qs, urlsplit

import msgspec

from iiwa_sim.server.token import Token
from iiwa_sim.server.web_access import LOCALHOST, WebAccess
from iiwa_sim.wording import harmless, shortened

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

MOST_BYTES = 65_536
"""Longest message from a browser: the longest that our page sends is a line that somebody has typed."""
MESSAGES_PER_S = 200.0
"""What is beyond waits: a browser of ours sends some 60 while the mouse is dragged."""
AT_ONCE = 200
ALLOWED = frozenset(
    {
        "CommandTriggerMessage",
        "GuiButtonHoldMessage",
        "GuiFormDirtyMessage",
        "GuiFormSubmitMessage",
        "GuiUpdateMessage",
        "SceneNodeClickMessage",
        "SceneNodeDragMessage",
        "TransformControlsDragEndMessage",
        "TransformControlsDragStartMessage",
        "TransformControlsUpdateMessage",
        "ViewerCameraMessage",
    }
)
"""Kinds of messages that are of use here. ShareUrlRequest would open the page to the world: it is none."""
_UPDATES = "GuiUpdateMessage"
_VALUE = "value"
_PORT = re.compile(r":[0-9]{1,5}$")

_FORM = """<!doctype html><html lang="en"><meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>iiwa-sim</title><style>body{font:16px sans-serif;margin:20vh auto;max-width:20em}</style>
<form method="get" action="/"><p>This robot's page asks for its token.</p>
<p><input type="password" name="token" autofocus autocomplete="current-password"> <button>Open</button></p>
<p>%s</p></form></html>
"""


class Rubbish(Exception):
    """What no browser of ours sends. The message says what it is, for the log."""


class Denied(Exception):
    """A request that is not let in."""

    def __init__(self, status: HTTPStatus, reason: str, page: str = "") -> None:
        super().__init__(reason)
        self.status = status
        self.page = page
        """HTML to show for it; plain text where empty."""


class Admitted(Exception):
    """Who asks has told the token: the answer leads to the page itself, with a cookie."""

    def __init__(self, cookie: str) -> None:
        super().__init__()
        self.cookie = cookie


class Gate:
    """Looks at requests: by their headers Host and Origin, and for the token if there is one.

    A browser tells the token once, in a form, and has a cookie from then on that holds as long as this
    process; what is no browser sends `Authorization: Bearer TOKEN`. Who knows it may ask by any name.
    """

    def __init__(self, token: Token | None) -> None:
        self._token = token
        self._access = WebAccess()
        self._key = secrets.token_urlsafe(32)

    def check(self, path: str, headers: Mapping[str, Sequence[str]], port: int) -> None:
        """Raises Denied, or Admitted; `headers` are those named host, origin, cookie, authorization.

        `port` is the one that is listened on: cookies are one machine's, whatever the port.
        """
        hosts = headers["host"]
        reason = self._access.refusal(hosts if self._token is None else [LOCALHOST], ())
        if reason is None and len(hosts) != 1:
            reason = f"{len(hosts)} headers Host: expected one"
        if reason is None:
            reason = _foreign(hosts[0], headers["origin"])
        if reason is not None:
            raise Denied(HTTPStatus.FORBIDDEN, reason)
        if self._token is not None:
            self._check_token(self._token, path, headers, f"iiwa-sim-{port}")

    def _check_token(self, token: Token, path: str, headers: Mapping[str, Sequence[str]], name: str) -> None:
        try:
            cookies = SimpleCookie("; ".join(headers["cookie"]))
        except CookieError:
            cookies = SimpleCookie()
        given = cookies[name].value if name in cookies else ""
        if secrets.compare_digest(given.encode(), self._key.encode()):
            return
        for header in headers["authorization"]:
            kind, _, word = header.partition(" ")
            if kind.lower() == "bearer" and token.fits(word.strip().encode()):
                return
        words = parse_qs(urlsplit(path).query, max_num_fields=8).get("token", [])
        if words and token.fits(words[0].strip().encode()):
            raise Admitted(f"{name}={self._key}; Path=/; HttpOnly; SameSite=Strict")
        page = _FORM % ("That was not it." if words else "")
        raise Denied(HTTPStatus.UNAUTHORIZED, "it has not told the token", page)


def check_message(raw: str | bytes) -> bool:
    """Whether a message is one to hand on; one of a kind that is of no use is not. Raises Rubbish."""
    if not isinstance(raw, bytes):
        raise Rubbish("text")
    try:
        message = msgspec.msgpack.decode(raw)
    except (msgspec.DecodeError, RecursionError, UnicodeDecodeError):
        raise Rubbish("what is no message") from None
    if not isinstance(message, dict) or not isinstance(message.get("type"), str):
        raise Rubbish("a message without a type")
    if message["type"] not in ALLOWED:
        return False
    if message["type"] == _UPDATES:
        updates = message.get("updates")
        if not isinstance(updates, dict) or set(updates) != {_VALUE}:
            # viser would set whatever attribute is named.
            raise Rubbish(f"an update of {shortened(harmless(str(updates)), 60)}")
    return True


def _foreign(host: str, origins: Sequence[str]) -> str | None:
    """Why a request with these headers is one of another site's page; None if it is not."""
    for origin in origins:
        _, _, its_host = origin.partition("://")
        if its_host.lower() != host.lower():
            return f"a page of '{shortened(harmless(origin), 100)}' asks, not one of ours"
    return None
