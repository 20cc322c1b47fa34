"""The backdoor over HTTP: its commands as JSON, and the robot's state and dialogue.

`POST /backdoor/emergency-stop` is the line `emergency stop`. Every command of the table has such a path,
except `help`, `bye` and `release when gone`. Answers are `{"reply": ...}`, or `{"error": {"code": ...,
"reason": ...}}` with a status that tells who has to change something.
"""

import asyncio
import json
from collections.abc import Coroutine
from http import HTTPStatus

import msgspec

from iiwa_sim.backdoor.backdoor import Backdoor
from iiwa_sim.backdoor.json_lines import line_of, reply_in_json
from iiwa_sim.backdoor.line_calls import BYE, HELP, RELEASE_WHEN_GONE, InternalError, LineCalls, NotUnderstood
from iiwa_sim.backdoor.recent_dialogue import RecentDialogue
from iiwa_sim.controller.errors import EXECUTION, Refused
from iiwa_sim.protocols.session import ProtocolLog
from iiwa_sim.protocols.table import Command
from iiwa_sim.server.http import HttpAnswer, HttpRequest
from iiwa_sim.server.token import Token
from iiwa_sim.server.web_access import LOCALHOST, WebAccess

COMMANDS = "/backdoor/"
"""What the path of each command begins with."""
HEALTH, STATE, DIALOGUE = "/healthz", "/state", "/dialogue"
OF_A_CONNECTION = (HELP, BYE, RELEASE_WHEN_GONE)
"""Commands that belong to a connection of lines and have no path."""
_BEARER = "bearer "


class BackdoorHttp:
    """Answers requests. To be used inside an asyncio loop in which time passes.

    With a `token`, requests have to carry it (`Authorization: Bearer TOKEN`), except for `/healthz`. Web
    pages are refused: a browser names the page in the header Origin, and a rebound host name shows in Host.
    """

    def __init__(
        self, backdoor: Backdoor, dialogue: RecentDialogue, log: ProtocolLog, token: Token | None = None
    ) -> None:
        self._backdoor = backdoor
        self._dialogue = dialogue
        self._log = log
        self._token = token
        self._access = WebAccess()

    def answer(self, request: HttpRequest) -> "HttpAnswer | asyncio.Task[HttpAnswer]":
        """The answer, or a task if time has to pass for it."""
        refusal = self._refusal(request)
        if refusal is not None:
            status, reason = refusal
            self._log.refused(self._name(request), f"{request.method} {request.path}", EXECUTION, reason)
            headers = (("www-authenticate", "Bearer"),) if status is HTTPStatus.UNAUTHORIZED else ()
            return _error(status, EXECUTION, reason)._replace(headers=headers)
        if request.path.startswith(COMMANDS):
            return self._command(request)
        pages = {HEALTH: self._health, STATE: self._state, DIALOGUE: self._dialogue.as_json}
        page = pages.get(request.path)
        if page is None:
            ways = f"POST {COMMANDS}COMMAND, or GET {', '.join(pages)}"
            return _error(HTTPStatus.NOT_FOUND, EXECUTION, f"there is no {request.path}: expected {ways}")
        if request.method not in ("GET", "HEAD"):
            return _not_allowed(request, "GET, HEAD")
        return _json(HTTPStatus.OK, page())

    def _refusal(self, request: HttpRequest) -> tuple[HTTPStatus, str] | None:
        # A client with the token is no rebound page, whatever Host it names.
        hosts = request.all("host") if self._token is None else [LOCALHOST]
        reason = self._access.refusal(hosts, ())
        if reason is None and (origins := request.all("origin")):
            reason = f"a web page asks, of {origins[0]}: the backdoor is not for web pages"
        if reason is not None:
            return HTTPStatus.FORBIDDEN, reason
        if (
            self._token is not None
            and request.path != HEALTH
            and not self._brings_token(request, self._token)
        ):
            return HTTPStatus.UNAUTHORIZED, "expected the header 'Authorization: Bearer TOKEN'"
        return None

    def _brings_token(self, request: HttpRequest, token: Token) -> bool:
        given = request.all("authorization")
        if len(given) != 1 or not given[0].lower().startswith(_BEARER):
            return False
        return token.fits(given[0][len(_BEARER) :].strip().encode("latin-1"))

    def _command(self, request: HttpRequest) -> "HttpAnswer | asyncio.Task[HttpAnswer]":
        calls = LineCalls(self._backdoor, self._log, self._name(request))
        command = calls.table.commands.get(request.path.removeprefix(COMMANDS).replace("-", " "))
        if command is None or command.name in OF_A_CONNECTION:
            reason = f"there is no {request.path}: docs/backdoor.md names all commands"
            return _error(HTTPStatus.NOT_FOUND, EXECUTION, reason)
        if request.method != "POST":
            return _not_allowed(request, "POST")
        line = request.path.encode("ascii", "backslashreplace")
        try:
            with calls.telling(line):
                line = line_of(command, request.body)
                reply = calls.start(calls.parse(line), line)
        except Refused as refused:
            return _refused(refused)
        if isinstance(reply, str):
            return _replied(calls, command, line, reply)
        return asyncio.get_running_loop().create_task(_awaited(calls, command, line, reply))

    def _health(self) -> object:
        return {"ok": True}

    def _state(self) -> object:
        return msgspec.to_builtins(self._backdoor.state(), str_keys=True)

    def _name(self, request: HttpRequest) -> str:
        return f"{request.client} (backdoor, HTTP)"


async def _awaited(
    calls: LineCalls, command: Command, line: bytes, reply: Coroutine[None, None, str]
) -> HttpAnswer:
    try:
        with calls.telling(line):
            answered = await reply
    except Refused as refused:
        return _refused(refused)
    return _replied(calls, command, line, answered)


def _replied(calls: LineCalls, command: Command, line: bytes, reply: str) -> HttpAnswer:
    calls.done(line, reply)
    return _json(HTTPStatus.OK, {"reply": reply_in_json(command, reply)})


def _refused(refused: Refused) -> HttpAnswer:
    status = HTTPStatus.CONFLICT
    if isinstance(refused, NotUnderstood):
        status = HTTPStatus.BAD_REQUEST
    elif isinstance(refused, InternalError):
        status = HTTPStatus.INTERNAL_SERVER_ERROR
    return _error(status, refused.code, refused.reason)


def _not_allowed(request: HttpRequest, allowed: str) -> HttpAnswer:
    reason = f"{request.path} is asked for by {allowed}, not by {request.method}"
    return _error(HTTPStatus.METHOD_NOT_ALLOWED, EXECUTION, reason)._replace(headers=(("allow", allowed),))


def _error(status: HTTPStatus, code: int, reason: str) -> HttpAnswer:
    return _json(status, {"error": {"code": code, "reason": reason}})


def _json(status: HTTPStatus, value: object) -> HttpAnswer:
    return HttpAnswer(status, json.dumps(value, separators=(",", ":")).encode() + b"\n")
