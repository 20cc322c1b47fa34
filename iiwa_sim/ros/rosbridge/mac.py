"""Authentication of a rosbridge client by a shared secret: the message authentication code of rosauth.

https://wiki.ros.org/rosauth: SHA-512 over the secret, client, dest, rand, t, level and end, concatenated; t
must be near the present time, and end in the future. t and end are seconds since 1970.
"""

from collections.abc import Callable
from hashlib import sha512
from hmac import compare_digest
from typing import Any

CLOCKS_APART_S = 5
_TEXTS = ("client", "dest", "rand", "level")


class Secret:
    """A secret that server and clients share."""

    def __init__(self, secret: str, now_ns: Callable[[], int]) -> None:
        self._secret = secret
        self._now_ns = now_ns

    def fault_of(self, auth: dict[str, Any]) -> str | None:
        """What is wrong with the fields of an `auth`; None if they are right."""
        texts = {name: auth.get(name) for name in (*_TEXTS, "mac")}
        times = {name: auth.get(name) for name in ("t", "end")}
        for name, text in texts.items():
            if not isinstance(text, str):
                return f"{name}: expected text"
        for name, time in times.items():
            if not isinstance(time, int) or isinstance(time, bool):
                return f"{name}: expected whole seconds since 1970"
        now_s = self._now_ns() // 1_000_000_000
        if abs(now_s - auth["t"]) > CLOCKS_APART_S:
            return f"t is more than {CLOCKS_APART_S} s from the time here"
        if auth["end"] < now_s:
            return "end is over"
        summed = "".join(
            [self._secret, *(str(auth[name]) for name in ("client", "dest", "rand", "t", "level", "end"))]
        )
        expected = sha512(summed.encode("utf-8", "backslashreplace")).hexdigest()
        if not compare_digest(expected.encode(), auth["mac"].encode("utf-8", "backslashreplace")):
            return "mac: made with another secret, or of other fields"
        return None
