"""The token by which clients of other machines authenticate at the backdoor."""

import ipaddress
import re

from iiwa_sim.wording import shortened

LONGEST = 256
"""Most characters of a token: it fits in a line of the protocol and in a header of HTTP."""

_TOKEN = re.compile(rf"[!-~]{{1,{LONGEST}}}")
_LOCALHOST = "localhost"

LOOPBACK = "127.0.0.1"
"""Default address of the backdoor: for tests on the same machine."""


class Token:
    """A secret word, compared in constant time."""

    def __init__(self, text: str) -> None:
        """Raises ValueError for a text that is not one word of printable ASCII."""
        if not _TOKEN.fullmatch(text):
            shown = f"{len(text)} characters, with others than printable ASCII or with blanks"
            if len(text) > LONGEST or not text:
                shown = f"{len(text)} characters"
            raise ValueError(f"the token has {shown}: expected 1 to {LONGEST} of printable ASCII, no blanks")
        self._text = text.encode()

    def fits(self, given: bytes) -> bool:
        """Whether this is the token."""
        import hmac  # which loads OpenSSL: only where there is a token

        return hmac.compare_digest(self._text, given)


def check_reach(host: str, token: Token | None, what: str = "backdoor", option: str = "") -> None:
    """Raises ValueError if other machines can reach `host` and there is no token.

    `what` listens there, and `option` of the command line would name a token.
    """
    if token is None and not _is_loopback(host):
        shown = shortened(repr(host), 40)
        remedy = f"expected a token{f', as by {option}' if option else ''}"
        raise ValueError(f"the {what} at {shown} can be reached from other machines: {remedy}")


def _is_loopback(host: str) -> bool:
    """A name other than localhost may resolve to any address, so it counts as none."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == _LOCALHOST
