"""A message of a recording: what a file holds."""

from typing import NamedTuple


class Message(NamedTuple):
    """One, ready to be written."""

    topic: str
    data: bytes
    log_ns: int
    """Simulated, since 1970."""
    publish_ns: int
    """Real, since 1970."""
