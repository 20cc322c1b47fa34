"""Makes foreign text safe for a message: one line, of bounded length, without control characters."""

from __future__ import annotations

import sys
from importlib.util import find_spec


class Unusable(Exception):
    """Something a user gave cannot be used: a file, a robot, an address.

    The message is one line for the screen; the command `iiwa-sim` ends with it and exit code 2.
    """


def need_library(name: str, extra: str) -> None:
    """Raise Unusable if a library of an extra of iiwa-sim is not installed."""
    if find_spec(name) is None:
        raise Unusable(f"this needs {name}: {sys.executable} -m pip install 'iiwa-sim[{extra}]'")


def harmless(text: str) -> str:
    """Escape characters that do not print: they would break a line, or control a terminal."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def shortened(text: str, longest: int) -> str:
    """Leave out the middle of a text that has more than `longest` characters."""
    if len(text) <= longest:
        return text
    kept = longest - len("...")
    return f"{text[: kept - kept // 2]}...{text[len(text) - kept // 2 :]}"


def distinct(value: float, *limits: float) -> list[str]:
    """Return a number and its limits as text, with enough digits (at least 7) to distinguish them."""
    texts: list[str] = []
    for digits in range(7, 18):
        texts = [f"{each:.{digits}g}" for each in (value, *limits)]
        if texts[0] not in texts[1:]:
            break
    return texts
