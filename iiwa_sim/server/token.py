"""The token by which clients of other machines authenticate at the backdoor and the page."""

import re
from pathlib import Path

LONGEST = 256
"""Most characters of a token: it fits in a line of the protocol and in a header of HTTP."""

_TOKEN = re.compile(rf"[!-~]{{1,{LONGEST}}}")

LOOPBACK = "127.0.0.1"
"""Default address of backdoor and page: for tests on the same machine."""
_LOOPBACK = re.compile(r"localhost|127(\.\d{1,3}){3}|::1")


class Token:
    """A secret word, compared in constant time."""

    def __init__(self, text: str) -> None:
        """Raises ValueError for a text that is not one word of printable ASCII."""
        if not _TOKEN.fullmatch(text):  # not shown: it may be a secret with a slip in it
            raise ValueError(f"expected a token of 1 to {LONGEST} printable ASCII characters without blanks")
        self._text = text.encode()

    def fits(self, given: bytes) -> bool:
        """Return True if this is the token."""
        import hmac  # which loads OpenSSL: only where there is a token

        return hmac.compare_digest(self._text, given)


def word_of(text: str | None, file: str | None) -> str | None:
    """Return the token that a text or a file names, None if neither does. Raises OSError."""
    return text if file is None else Path(file).read_text(encoding="utf-8-sig").strip()


def is_loopback(host: str) -> bool:
    """Return True if only this machine reaches an address; of names only localhost counts."""
    return _LOOPBACK.fullmatch(host.lower()) is not None
