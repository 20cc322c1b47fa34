r"""Texts of a transcript in both protocols: how they are sent, filled in and compared.

A text of the iiwa's protocol is a line. A KRC4 message is in its short form (see `krc4_xml`) or verbatim. In
both, bytes that do not print are written `\x09`, a backslash `\\`, and a literal brace `\x7b`.

`{get tool frame}` stands for the last reply to that command, `{get tool frame 3}` for its third number, and
`{get tool frame + 0 0 9 0 0 0}` for its numbers with these added. Of KRC4 messages `{GOP}` stands for the
reals of the last reply, and `{GOP + 0 0 10}` for them with these added.
"""

import math
import re
from collections.abc import Mapping

from iiwa_sim.protocols.krc4_xml import (
    LARGEST_INTEGER,
    REPLY,
    REQUEST,
    Broken,
    Message,
    XmlStream,
    from_short,
    is_short,
    load_krc4_table,
    reply_of,
    to_xml,
    understand,
    written,
)
from iiwa_sim.protocols.ports import KRC4
from iiwa_sim.wording import Unusable, harmless, shortened

LONGEST_MESSAGE = 400
"""Most characters of a message, which may quote paths and lines."""

_PLACEHOLDER = re.compile(r"\{(?P<topic>[a-z ]+?|[A-Z]{3})(?: (?P<place>\d+))?\s*(?:\+(?P<more>[^{}]*))?\}")
_TAGS = {command.id: command.tag for command in load_krc4_table().values()}
_FIN = next(number for number, name in _TAGS.items() if name == "FIN")


class TranscriptFault(Unusable):
    """A transcript cannot be read, written or played. The message is one line that names file or server."""

    def __init__(self, message: str) -> None:
        super().__init__(shortened(harmless(message), LONGEST_MESSAGE))


def wire_bytes(text: str) -> bytes:
    """Return the bytes for a text. Raises ValueError for a malformed escape."""
    return re.sub(rb"\\(x[0-9a-f]{2}|.|$)", _unescaped, text.encode())


def command_of(text: str) -> str:
    """Return the command of a line, in lower case and with single blanks."""
    return " ".join(text.partition(":")[0].lower().split())


def topic(protocol: str, text: str) -> str:
    """Return the name in braces for the reply to a text; of a KRC4 message its tag, empty if it has none."""
    if protocol != KRC4:
        return command_of(text)
    try:
        return _TAGS.get(understood(_PLACEHOLDER.sub("", text), REQUEST).command, "")
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
    if isinstance(found, Broken):
        raise ValueError(str(found))
    return understand(found, root)


def ask_status(protocol: str) -> str:
    """Return the text that asks whether the robot moves."""
    return "get status" if protocol != KRC4 else f"Cmd I0={LARGEST_INTEGER} I1={_FIN}"


def is_moving(protocol: str, reply: str) -> bool:
    """Return True if the reply to `ask_status` says that the robot moves. Raises ValueError."""
    if protocol != KRC4:
        if reply not in ("moving", "stopped"):
            raise ValueError(f"expected 'moving' or 'stopped', got '{reply}'")
        return reply == "moving"
    got = understood(reply, REPLY)
    if got.fault or got.integers[:2] != (LARGEST_INTEGER, _FIN) or got.integers[2] not in (0, 1):
        raise ValueError(f"expected I2 to be 0 or 1, got '{reply}'")
    return got.integers[2] == 0


def filled(protocol: str, text: str, heard: Mapping[str, str]) -> str:
    """Return a text with placeholders replaced by the last replies, given by topic. Raises ValueError."""

    def fill(found: re.Match[str]) -> str:
        reply = heard.get(found["topic"])
        if reply is None:
            raise ValueError(f"'{found['topic']}' has not been asked yet")
        more = None if found["more"] is None else _numbers(found["more"])
        if protocol == KRC4:
            return _reals(found["topic"], reply, more or [])
        place = int(found["place"] or 0)
        if place:
            if place > len(reply.split()):
                raise ValueError(f"expected {place} numbers or more, got '{reply}'")
            reply = reply.split()[place - 1]
        if more is None:
            return reply
        numbers = _numbers(reply)
        if len(numbers) != len(more):
            raise ValueError(f"expected {len(numbers)} numbers behind the + of {found[0]}, got {len(more)}")
        return " ".join(f"{number + other:.9f}" for number, other in zip(numbers, more, strict=True))

    return _PLACEHOLDER.sub(fill, text)


def deviation(protocol: str, wanted: str, within: float | None, reply: str) -> str:
    """Return how a reply differs from the expected text; empty if it does not.

    With `within` None both are equal: lines and verbatim messages word for word, messages in short form by
    their values. Otherwise numbers differ by at most `within`; integers of KRC4 messages not at all.
    """
    if protocol == KRC4 and (within is not None or is_short(wanted)):
        return _message_deviation(understood(wanted, REPLY), within or 0.0, reply)
    wanted = wanted.replace("\\x7b", "{")
    if within is None:
        return "" if reply == wanted else f"expected '{wanted}', got '{reply}'"
    words, others = reply.split(), wanted.split()
    if len(words) != len(others):
        return f"expected {len(others)} values, got {len(words)}: '{reply}'"
    for place, (word, other) in enumerate(zip(words, others, strict=True), 1):
        if word != other and not abs(_number(word) - _number(other)) <= within:
            return f"value {place} is {word}, expected {other} within {within:g}: '{reply}'"
    return ""


def _message_deviation(wanted: Message, within: float, reply: str) -> str:
    shown = written(reply_of(wanted.integers, wanted.reals))
    try:
        found = understood(reply, REPLY)
    except ValueError as broken:
        return f"expected '{shown}', got '{reply}': {broken}"
    got = written(reply_of(found.integers, found.reals))
    if found.fault or found.integers != wanted.integers:
        return f"expected '{shown}', got '{got}'{found.fault and f': {found.fault}'}"
    for place, (real, other) in enumerate(zip(found.reals, wanted.reals, strict=True)):
        if not abs(real - other) <= within:
            return f"R{place} is {real}, expected {other} within {within:g}: '{got}'"
    return ""


def _reals(tag: str, reply: str, more: list[float]) -> str:
    """Return the reals of a KRC4 reply, with numbers added."""
    last = understood(reply, REPLY)
    if last.fault or _TAGS.get(last.command) != tag:
        raise ValueError(f"expected '{tag}' to have been answered, got '{reply}'")
    added = [real + other for real, other in zip(last.reals, [*more, *[0.0] * len(last.reals)], strict=False)]
    return " ".join(written(reply_of((), added)).split()[3:])


def _numbers(text: str) -> list[float]:
    numbers = list(map(_number, text.split()))
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"expected finite numbers, got '{text}'")
    return numbers


def _number(word: str) -> float:
    """Return the number that a word stands for; nan if it is none, or not finite."""
    try:
        value = float(word)
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan


def _unescaped(found: re.Match[bytes]) -> bytes:
    escape = found[1]
    if escape.startswith(b"x") and len(escape) == 3:
        return bytes([int(escape[1:], 16)])
    plain = {b"\\": b"\\", b"'": b"'", b"t": b"\t", b"n": b"\n", b"r": b"\r"}
    if escape not in plain:
        raise ValueError(f"no escape: {found[0]!r}")
    return plain[escape]
