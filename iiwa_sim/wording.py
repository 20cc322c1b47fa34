"""Text of others within a message of ours: one line, of bounded length, that steers no terminal."""

from __future__ import annotations


class Unusable(Exception):
    """What a user gave cannot be used: a file, a robot, an address, a stdout.

    The message is one line for the screen; the command `iiwa-sim` ends with it and exit code 2.
    """


def harmless(text: str) -> str:
    """Text that cannot pass for another line, nor steer a terminal: what does not print is escaped."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def shortened(text: str, longest: int) -> str:
    """Text of at most `longest` characters: what is too long loses its middle."""
    if len(text) <= longest:
        return text
    kept = longest - len("...")
    return f"{text[: kept - kept // 2]}...{text[len(text) - kept // 2 :]}"
