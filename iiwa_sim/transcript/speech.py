"""What a player has to know of each dialect: how it is sent, what a reply is, and whether that deviates."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from iiwa_sim.dialect.ports import IIWA, KRC4
from iiwa_sim.transcript import compare, krc4, krc4_compare
from iiwa_sim.transcript.escapes import wire_bytes
from iiwa_sim.transcript.lines import Answered, Said, Transcript, command_of
from iiwa_sim.transcript.wire import MessageWire, Wire


class Speech(NamedTuple):
    """Texts are as in a transcript; functions that take one raise ValueError where it makes no sense."""

    connect: Callable[[str, int, float], Wire | MessageWire]
    """To a host and a port, with the patience for each reply (s)."""
    filled: Callable[[str, Mapping[str, str]], str]
    """A text with the last replies, by their topics, in place of what stands for them in braces."""
    sent: Callable[[str], bytes]
    """What is sent for a text."""
    topic: Callable[[str], str]
    """What braces call the reply to a text."""
    deviation: Callable[[Answered, str, Mapping[str, str]], str]
    """What is different in a reply, in words; empty where nothing is."""
    ask_status: Callable[[Transcript], str]
    """What asks whether the robot moves."""
    is_moving: Callable[[str, str], bool]
    """Whether it does, from that question and its reply."""


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
