r"""Texts of a transcript in both protocols: how they are sent, filled in and compared.

A text of the iiwa's protocol is a line. A KRC4 message is in its short form (see `krc4_xml`) or verbatim. In
both, bytes that do not print are written `\x09`, a backslash `\\`, and a literal brace `\x7b`.

`{get tool frame}` stands for the last reply to that command, `{get tool frame 3}` for its third number.
`{get tool frame + 0 0 9 0 0 0}` stands for its numbers with these added. With KRC4 messages `{GOP}` stands
for the reals of the last reply, and `{GOP + 0 0 10}` for them with these added.
"""

import math
import re
from collections.abc import Mapping
from itertools import chain, repeat

from iiwa_sim.protocols.krc4_xml import (
    LARGEST_INTEGER,
    REPLY,
    REQUEST,
    TAGS,
    Message,
    XmlStream,
    from_short,
    is_short,
    reply_of,
    to_xml,
    understand,
)
from iiwa_sim.protocols.ports import IIWA, KRC4
from iiwa_sim.wording import Unusable, harmless, shortened

LONGEST_MESSAGE = 400
"""Most characters of a message, which may quote paths and lines."""

ASK_STATUS = {IIWA: "get status", KRC4: f"Cmd I0={LARGEST_INTEGER} I1=100"}
"""Texts that ask whether the robot moves, by protocol."""

_PLACEHOLDER = re.compile(r"\{(?P<topic>[a-z ]+?|[A-Z]{3})(?: (?P<place>\d+))?\s*(?:\+(?P<more>[^{}]*))?\}")
_ESCAPES = {rb"\x%02x" % byte: bytes([byte]) for byte in range(256)}
_ESCAPES |= {rb"\\": b"\\", rb"\'": b"'", rb"\t": b"\t", rb"\n": b"\n", rb"\r": b"\r"}


class TranscriptFault(Unusable):
    """A transcript cannot be read, written or played. The message is one line that names file or server."""

    def __init__(self, message: str) -> None:
        super().__init__(shortened(harmless(message), LONGEST_MESSAGE))


def wire_bytes(text: str) -> bytes:
    """Return the bytes for a text. Raises ValueError for a malformed escape."""
    try:
        return re.sub(rb"\\(?:x..|.?)", lambda found: _ESCAPES[found[0]], text.encode())
    except KeyError as fault:
        raise ValueError(f"no escape: {fault}") from None


def command_of(text: str) -> str:
    """Return the command of a line, in lower case and with single blanks."""
    return " ".join(text.partition(":")[0].lower().split())


def topic(protocol: str, text: str) -> str:
    """Return the name in braces for the reply to a text; of a KRC4 message its tag, empty if it has none."""
    if protocol != KRC4:
        return command_of(text)
    try:
        return TAGS.get(understood(_PLACEHOLDER.sub("", text), REQUEST).command, "")
    except ValueError:
        return ""


def sent(protocol: str, text: str) -> bytes:
    """Return the bytes that are sent for a text. Raises ValueError."""
    if protocol != KRC4:
        return wire_bytes(text) + b"\r\n"
    return to_xml(from_short(text)) if is_short(text) else wire_bytes(text)


def understood(text: str, root: str) -> Message:
    """Return the numbers of a KRC4 message. Raises ValueError if the text is none."""
    if is_short(text):
        return understand(from_short(text), root)
    stream = XmlStream()
    stream.receive(wire_bytes(text))
    stream.end()
    found = stream.next()
    if found is None:
        raise ValueError("no message")
    return understand(found, root)


def is_moving(protocol: str, reply: str) -> bool:
    """Return True if the reply to a text of ASK_STATUS says that the robot moves. Raises ValueError."""
    status = _values(protocol, reply).get("I2" if protocol == KRC4 else "value 1")
    if status not in (moving := {"0": True, "moving": True, "1": False, "stopped": False}):
        raise ValueError(f"expected 'moving' or 'stopped', 0 or 1, got '{reply}'")
    return moving[status]


def filled(protocol: str, text: str, replies: Mapping[str, str]) -> str:
    """Return a text with placeholders replaced by the last replies, given by topic. Raises ValueError."""

    def fill(found: re.Match[str]) -> str:
        reply = replies.get(found["topic"])
        if reply is None:
            raise ValueError(f"'{found['topic']}' has not been asked yet")
        words = _values(protocol, reply)
        if protocol == KRC4:
            if TAGS.get(int(words["I1"])) != found["topic"]:
                raise ValueError(f"expected '{found['topic']}' to have been answered, got '{reply}'")
            words = {name: word for name, word in words.items() if name[0] == "R"}
        elif found["place"]:
            words = {name: word for name, word in words.items() if name == f"value {found['place']}"}
        if found["more"] is not None:
            more = chain(map(_number, found["more"].split()), repeat(0.0))
            words = {name: f"{_number(word) + next(more):.9f}" for name, word in words.items()}
        if not words or "nan" in words.values():
            raise ValueError(f"expected numbers for {found[0]}, got '{reply}'")
        return " ".join(f"{name}={word}" if protocol == KRC4 else word for name, word in words.items())

    return _PLACEHOLDER.sub(fill, text)


def deviation(protocol: str, wanted: str, within: float | None, reply: str) -> str:
    """Return how a reply differs from the expected text; empty if it does not.

    With `within` None both are equal: lines and verbatim messages word for word, messages in short form by
    their values. Otherwise numbers differ by at most `within`; integers of KRC4 messages not at all.
    """
    if within is None and not (protocol == KRC4 and is_short(wanted)):
        wanted = wanted.replace("\\x7b", "{")
        return "" if reply == wanted else f"expected '{wanted}', got '{reply}'"
    within, got, expected = within or 0.0, _values(protocol, reply), _values(protocol, wanted)
    if len(got) != len(expected):
        return f"expected {len(expected)} values, got {len(got)}: '{reply}'"
    for name, other in expected.items():
        is_near = name[0] != "I" and abs(_number(got[name]) - _number(other)) <= within
        if got[name] != other and not is_near:
            return f"{name} is {got[name]}, expected {other} within {within:g}: '{reply}'"
    return ""


def _values(protocol: str, reply: str) -> dict[str, str]:
    """Return the values of a reply by their names. Raises ValueError for no KRC4 message."""
    if protocol != KRC4:
        return {f"value {place}": word for place, word in enumerate(reply.split(), 1)}
    found = understood(reply, REPLY)
    if found.fault:
        raise ValueError(f"{found.fault}: '{reply}'")
    return reply_of(found.integers, found.reals).values


def _number(word: str) -> float:
    """Return the number that a word stands for; nan if it is none."""
    try:
        return float(word)
    except ValueError:
        return math.nan
