"""KRC4 messages in a transcript: in short form (`iiwa_sim.protocols.krc4_xml`), or verbatim.

In both, `{GOP}` stands for the reals of the last reply to that message, `R0=445.0 R2=810.0` without those
that are 0; `{GOP + 0 0 10}` for them with these added, from R0 on; `{GOP R2}` for one register, and `{GOP R2
+ 10}` for it with 10 added.
"""

import math
import re
from collections.abc import Mapping

from iiwa_sim.protocols.decimals import format_decimals
from iiwa_sim.protocols.krc4_xml import (
    LARGEST_INTEGER,
    REGISTERS,
    REPLY,
    REQUEST,
    Broken,
    Message,
    XmlStream,
    from_short,
    is_short,
    load_krc4_table,
    short_reply,
    to_xml,
    understand,
)
from iiwa_sim.transcript.escapes import wire_bytes

_HEARD = re.compile(r"\{(?P<tag>[A-Z]{3})(?: (?P<register>[IR][0-9]))?\s*(?:\+(?P<more>[^{}]*))?\}")
_ID = re.compile(r"I0\W+([0-9]+)")
_FIN = next(command.id for command in load_krc4_table().commands.values() if command.tag == "FIN")
_TAGS = {command.tag: command.id for command in load_krc4_table().commands.values()}


def check(text: str) -> None:
    """Check that a text is a message, or can be sent. Raises ValueError."""
    sent(_unfilled(text))


def check_reply(text: str, has_to_be_read: bool) -> None:
    """Check that a text can be a reply; a verbatim one that is compared verbatim need not be parsed.

    Raises ValueError.
    """
    bare = _unfilled(text)
    if is_short(bare) or has_to_be_read:
        parsed = understood(bare, REPLY)
        if parsed.fault:
            raise ValueError(parsed.fault)


def sent(text: str) -> bytes:
    """The bytes of a text. Raises ValueError."""
    return to_xml(from_short(text)) if is_short(text) else wire_bytes(text)


def understood(text: str, root: str) -> Message:
    """The numbers of a message. Raises ValueError if the text is none."""
    if is_short(text):
        return understand(from_short(text), root)
    stream = XmlStream()
    stream.receive(wire_bytes(text))
    stream.end()
    found = stream.next()
    if found is None:
        raise ValueError("no message")
    if isinstance(found, Broken):
        raise ValueError(found.reason)
    return understand(found, root)


def tag(text: str) -> str:
    """The name of a message, such as GOP; empty if it has none."""
    try:
        said = understood(_unfilled(text), REQUEST).command
    except ValueError:
        return ""
    return next((name for name, number in _TAGS.items() if number == said), "")


def answers_reals(reply: str) -> bool:
    """Whether a reply in short form answers a message that asks for reals."""
    command = load_krc4_table().commands.get(understood(reply, REPLY).command)
    return command is not None and (
        command.joints == "output" or any(register.startswith("R") for register in command.outputs)
    )


def filled(text: str, heard: Mapping[str, str]) -> str:
    """Text with `{GOP ...}` replaced by registers of the last replies, which `heard` has by tag. Raises
    ValueError."""
    return _HEARD.sub(lambda found: _filled(found, heard), text)


def ask_idle(texts: list[str]) -> str:
    """A FIN message with the largest id that none of the texts has."""
    taken = {int(found) for text in texts for found in _ID.findall(text)}
    number = next(each for each in range(LARGEST_INTEGER, 0, -1) if each not in taken)
    return f"Cmd I0={number} I1={_FIN}"


def is_moving(asked: str, reply: str) -> bool:
    """Whether the reply to `ask_idle` says that the robot moves. Raises ValueError for another reply."""
    expected = understood(asked, REQUEST).integers[:2]
    got = understood(reply, REPLY)
    if got.fault or got.integers[:2] != expected or got.integers[2] not in (0, 1):
        raise ValueError(f"expected I2 to be 0 or 1, got '{reply}'")
    return got.integers[2] == 0


def _unfilled(text: str) -> str:
    """Text with placeholder numbers for `{GOP ...}`, to check it before it is sent. Raises ValueError."""

    def without(found: re.Match[str]) -> str:
        if found["tag"] not in _TAGS:
            raise ValueError(f"{found[0]}: expected one of {', '.join(_TAGS)}")
        _summands(found)
        return "0" if found["register"] else ""

    return _HEARD.sub(without, text)


def _filled(found: re.Match[str], heard: Mapping[str, str]) -> str:
    reply = heard.get(found["tag"])
    if reply is None:
        raise ValueError(f"'{found['tag']}' has not been asked yet")
    last = understood(reply, REPLY)
    if last.fault or last.command != _TAGS[found["tag"]]:
        raise ValueError(f"expected '{found['tag']}' to have been answered, got '{reply}'")
    more, register = _summands(found), found["register"]
    if register is None:
        reals = [real + other for real, other in zip(last.reals, more, strict=True)]
        return " ".join(short_reply((), reals).split()[1:])
    place = int(register[1:])
    if register.startswith("I"):
        return str(last.integers[place])
    return format_decimals([last.reals[place] + more[0]]).decode()


def _summands(found: re.Match[str]) -> list[float]:
    most = REGISTERS if found["register"] is None else int(found["register"].startswith("R"))
    if found["more"] is not None and most == 0:
        raise ValueError(f"{found[0]}: expected nothing behind an integer register")
    words = (found["more"] or "").split()
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = [math.nan]
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"{found[0]}: expected finite numbers behind the +, got '{' '.join(words)}'")
    if found["more"] is not None and not 1 <= len(numbers) <= most:
        several = "a number" if most == 1 else f"1 to {most} numbers"
        raise ValueError(f"{found[0]}: expected {several} behind the +, got {len(numbers)}")
    return numbers + [0.0] * (REGISTERS - len(numbers))
