"""A client of the backdoor over HTTP, for a test in another process or on another machine."""

import contextlib
import http.client
import json
from collections.abc import Callable
from functools import partial
from typing import Any

import msgspec

from iiwa_sim.controller.errors import COMMUNICATION_FAILURE, Refused


class BackdoorClient:
    """Client with the methods of `Backdoor`, called over HTTP.

    Arguments are those of `Backdoor`; results are values of JSON, or the bytes of a picture. A method raises
    `Refused` where the backdoor rejects the call, and OSError without an answer within `timeout_s`. Each
    call has its own connection, so threads may share a client. `robot` names one of several.
    """

    def __init__(
        self, host: str, port: int, token: str = "", timeout_s: float = 60.0, robot: str = ""
    ) -> None:
        self._address, self._timeout_s = (host, port), timeout_s
        self._headers = {"Authorization": f"Bearer {token}"} if token else {}
        self._path = f"/{robot}" if robot else ""

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name.startswith("_"):
            raise AttributeError(name)
        return partial(self._call, f"{self._path}/{name}")

    def _call(self, path: str, /, *args: object, **arguments: object) -> Any:
        body = msgspec.json.encode(dict(enumerate(args)) | arguments)
        connection = http.client.HTTPConnection(*self._address, timeout=self._timeout_s)
        with contextlib.closing(connection):
            try:
                connection.request("POST", path, body, self._headers)
                answer = connection.getresponse()
                is_picture = answer.headers.get_content_type() == "image/png"
                value: Any = answer.read() if is_picture else json.loads(answer.read())
                error = value["error"] if answer.status != http.client.OK else None
            except (http.client.HTTPException, ValueError, KeyError, TypeError) as fault:
                raise ConnectionError(f"no answer of a backdoor to {path}: {fault}") from None
        if error is not None:
            raise Refused(int(error.get("code", COMMUNICATION_FAILURE)), str(error.get("reason")))
        return value
