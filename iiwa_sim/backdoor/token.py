"""What somebody who uses the backdoor from another machine has to know."""

import hmac
import ipaddress
import re

from iiwa_sim.wording import shortened

LONGEST = 256
"""Characters of a token: it fits in a line of the protocol and in a header of HTTP."""

_TOKEN = re.compile(rf"[!-~]{{1,{LONGEST}}}")
_LOCALHOST = "localhost"

LOOPBACK = "127.0.0.1"
"""Where the backdoor listens unless it is told otherwise: for tests on the same machine."""


class Token:
    """A word that is compared in a time that tells nothing of it."""

    def __init__(self, text: str) -> None:
        """Raises ValueError for what cannot be sent as one word of printable ASCII."""
        if not _TOKEN.fullmatch(text):
            shown = f"{len(text)} characters, with others than printable ASCII or with blanks"
            if len(text) > LONGEST or not text:
                shown = f"{len(text)} characters"
            raise ValueError(f"the token has {shown}: expected 1 to {LONGEST} of printable ASCII, no blanks")
        self._text = text.encode()

    def fits(self, given: bytes) -> bool:
        """Whether this is it."""
        return hmac.compare_digest(self._text, given)


def check_reach(host: str, token: Token | None) -> None:
    """Raises ValueError where other machines reach the backdoor at `host`, and there is no token."""
    if token is None and not _is_loopback(host):
        shown = shortened(repr(host), 40)
        raise ValueError(f"the backdoor at {shown} can be reached from other machines: expected a token")


def _is_loopback(host: str) -> bool:
    """Of a name other than localhost nobody knows what it will stand for."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == _LOCALHOST
