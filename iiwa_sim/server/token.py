"""The token by which clients of other machines authenticate at the backdoor and the page."""

import re
from pathlib import Path

LOOPBACK = "127.0.0.1"
"""Default address of backdoor and page: for tests on the same machine."""
_TOKEN = re.compile(r"[!-~]{1,256}")
_LOOPBACK = re.compile(r"localhost|127(\.\d{1,3}){3}|::1")


def check_token(text: str | None) -> None:
    """Raise ValueError for a text that is not one word of printable ASCII."""
    if not _TOKEN.fullmatch(text or ""):  # not shown: it may be a secret with a slip in it
        raise ValueError("expected a token")


def fits(token: str, given: bytes) -> bool:
    """Return True if a client gave this token; the time taken does not depend on it."""
    import hmac  # which loads OpenSSL: only where there is a token

    return hmac.compare_digest(token.encode(), given)


def word_of(text: str | None, file: str | None) -> str | None:
    """Return the token that a text or a file names, None if neither does. Raises OSError."""
    return text if file is None else Path(file).read_text(encoding="utf-8-sig").strip()


def is_loopback(host: str) -> bool:
    """Return True if only this machine reaches an address; of names only localhost counts."""
    return _LOOPBACK.fullmatch(host.lower()) is not None
