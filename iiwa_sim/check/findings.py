"""The result of a probe: how the server answers, compared with the original server and with this
simulator."""

from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

from iiwa_sim.check.link import Link


class Verdict(Enum):
    """Whose behaviour it is. The values stand in the report."""

    ORIGINAL = "as the original"
    OURS = "as iiwa-sim"
    DEVIATION = "DEVIATION"
    UNTRIED = "not tried"


class Finding(NamedTuple):
    """The verdict on a probe, and what was observed."""

    verdict: Verdict
    seen: str = ""


class Probe(NamedTuple):
    """One question to a server, with what is known of the original."""

    event: str
    """What happens, or is sent."""
    original: str
    """What the original does; empty for a dialogue, which tells it line by line."""
    ours: str
    """What this simulator does instead, and why; empty if it does the same."""
    ask: Callable[[Link], Finding]
    """Asks the server; raises NoReply for a deviation."""
    moves: bool = False
    """Whether it needs a move command."""


def same(seen: str = "") -> Finding:
    """The server behaves like the original."""
    return Finding(Verdict.ORIGINAL, seen)


def ours(seen: str = "") -> Finding:
    """The server behaves like this simulator, which differs from the original."""
    return Finding(Verdict.OURS, seen)


def deviates(seen: str) -> Finding:
    """The server behaves like neither."""
    return Finding(Verdict.DEVIATION, seen)


def untried(why: str) -> Finding:
    """The probe could not be made."""
    return Finding(Verdict.UNTRIED, why)
