"""What a player needs of each protocol: how texts are sent and replies are read and compared."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from iiwa_sim.protocols.ports import IIWA, KRC4
from iiwa_sim.transcript import compare, krc4, krc4_compare
from iiwa_sim.transcript.escapes import wire_bytes
from iiwa_sim.transcript.lines import Answered, Said, Transcript, command_of
from iiwa_sim.transcript.wire import MessageWire, Wire


class Speech(NamedTuple):
    """Texts are those of a transcript; functions that take one raise ValueError for a malformed one."""

    connect: Callable[[str, int, float], Wire | MessageWire]
    """Connects to a host and a port, with a time limit (s) for each reply."""
    filled: Callable[[str, Mapping[str, str]], str]
    """Replaces placeholders in braces by the last replies, which are given by topic."""
    sent: Callable[[str], bytes]
    """The bytes that are sent for a text."""
    topic: Callable[[str], str]
    """The name in braces for the reply to a text."""
    deviation: Callable[[Answered, str, Mapping[str, str]], str]
    """The difference of a reply in words; empty if there is none."""
    ask_status: Callable[[Transcript], str]
    """The text that asks whether the robot moves."""
    is_moving: Callable[[str, str], bool]
    """Whether the robot moves, from that text and its reply."""


def _line(text: str) -> bytes:
    return wire_bytes(text) + b"\r\n"


def _says_moving(_: str, reply: str) -> bool:
    if reply not in ("moving", "stopped"):
        raise ValueError(f"expected 'moving' or 'stopped', got '{reply}'")
    return reply == "moving"


def _ask_idle(transcript: Transcript) -> str:
    return krc4.ask_idle([step.text for step in transcript.steps if isinstance(step, Said)])


SPEECH = {
    IIWA: Speech(
        Wire, compare.filled, _line, command_of, compare.deviation, lambda _: "get status", _says_moving
    ),
    KRC4: Speech(
        MessageWire, krc4.filled, krc4.sent, krc4.tag, krc4_compare.deviation, _ask_idle, krc4.is_moving
    ),
}
