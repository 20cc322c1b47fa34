"""What a probe finds: how the server answers, beside the original server and beside this simulator."""

from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

from iiwa_sim.check.link import Link


class Verdict(Enum):
    """Whose way it is. The values stand in the report."""

    ORIGINAL = "as the original"
    OURS = "as iiwa-sim"
    DEVIATION = "DEVIATION"
    UNTRIED = "not tried"


class Finding(NamedTuple):
    """How it is, and what was seen."""

    verdict: Verdict
    seen: str = ""


class Probe(NamedTuple):
    """One question to a server: a row of what is known of the original."""

    event: str
    """What happens, or is sent."""
    original: str
    """What the original does then; empty for a dialogue, which tells it line by line."""
    ours: str
    """What this simulator does instead, and why; empty where it does the same."""
    ask: Callable[[Link], Finding]
    """Finds out. What raises NoReply is a deviation."""
    moves: bool = False
    """Whether it takes a move command to find out."""


def same(seen: str = "") -> Finding:
    """The original's way."""
    return Finding(Verdict.ORIGINAL, seen)


def ours(seen: str = "") -> Finding:
    """The way of this simulator, where that is another one."""
    return Finding(Verdict.OURS, seen)


def deviates(seen: str) -> Finding:
    """Neither."""
    return Finding(Verdict.DEVIATION, seen)


def untried(why: str) -> Finding:
    """Not found out."""
    return Finding(Verdict.UNTRIED, why)
