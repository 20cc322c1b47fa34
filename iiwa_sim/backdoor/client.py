"""A client of the backdoor over HTTP, for a test in another process or on another machine."""

import contextlib
import http.client
import json
from collections.abc import Callable
from functools import partial
from typing import Any

import msgspec

from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, Refused

ANSWERED_S = 60.0


class BackdoorClient:
    """Has the methods of `Backdoor`, and calls them over HTTP.

    Arguments are those of `Backdoor`; results are values of JSON, or the bytes of a picture. A method raises
    `Refused` where the backdoor rejects the call, and OSError where nobody answers within `timeout_s`. Each
    call has its own connection, so threads may share a client. `robot` names one of several.
    """

    def __init__(
        self, host: str, port: int, token: str = "", timeout_s: float = ANSWERED_S, robot: str = ""
    ) -> None:
        self._address = host, port
        self._headers = {"Authorization": f"Bearer {token}"} if token else {}
        self._timeout_s = timeout_s
        self._path = f"/{robot}" if robot else ""
        self._calls: dict[str, Any] = {}

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name.startswith("_"):
            raise AttributeError(name)
        return partial(self._call, name)

    def __dir__(self) -> list[str]:
        return list(self._known())

    def _call(self, name: str, /, *args: object, **arguments: object) -> Any:
        if args:
            names = [each.partition("=")[0] for each in self._known().get(name, {"takes": ()})["takes"]]
            if len(args) > len(names):
                raise TypeError(f"{name} takes {', '.join(names) or 'no arguments'}: {len(args)} given")
            arguments = dict(zip(names, args, strict=False)) | arguments
        return self._ask("POST", f"{self._path}/{name}", msgspec.json.encode(arguments))

    def _known(self) -> dict[str, Any]:
        if not self._calls:
            self._calls = self._ask("GET", "/")
        return self._calls

    def _ask(self, method: str, path: str, body: bytes | None = None) -> Any:
        connection = http.client.HTTPConnection(*self._address, timeout=self._timeout_s)
        with contextlib.closing(connection):
            try:
                connection.request(method, path, body, self._headers)
                answer = connection.getresponse()
                is_picture = answer.headers.get_content_type() == "image/png"
                value: Any = answer.read() if is_picture else json.loads(answer.read())
                error = value["error"] if answer.status != http.client.OK else None
            except (http.client.HTTPException, ValueError, KeyError, TypeError) as fault:
                raise ConnectionError(f"no answer of a backdoor to {path}: {fault}") from None
        if error is not None:
            raise Refused(int(error.get("code", COMMUNICATION_FAILURE)), str(error.get("reason")))
        return value
