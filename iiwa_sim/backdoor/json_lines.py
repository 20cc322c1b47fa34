"""Commands of the backdoor as JSON: an object becomes a line of the table, and the reply becomes JSON.

The table defines what a command takes, so clients of JSON and of lines can do the same and get the same
refusals. Numbers have the names of the table. A number for each joint is one list, named without the joint's
number: `{"j": [0, 0.5, 0, -1.2, 0, 1.4, 0]}`.
"""

import json
from typing import NamedTuple

import msgspec

from iiwa_sim.backdoor.line_calls import NotUnderstood
from iiwa_sim.controller.errors import COMMUNICATION_FAILURE
from iiwa_sim.protocols.lines import MAX_LINE_BYTES
from iiwa_sim.protocols.table import BETWEEN_PHRASES, Command, Quantity
from iiwa_sim.wording import harmless, shortened

_LONGEST_SHOWN = 40


class Field(NamedTuple):
    """A number, or a list of numbers, of a command or a reply."""

    name: str
    quantity: Quantity
    length: int | None
    """Length of the list; None for a single number."""


def fields(quantities: tuple[Quantity, ...]) -> list[Field]:
    """The fields for numbers of the table; numbers that differ only in their index become one list."""
    if len(quantities) > 1 and all(
        each.name == f"{_stem(each)}{place}" for place, each in enumerate(quantities)
    ):
        return [Field(_stem(quantities[0]), quantities[0], len(quantities))]
    return [Field(each.name, each, None) for each in quantities]


def line_of(command: Command, body: bytes) -> bytes:
    """The line for a command with a body in JSON. Raises NotUnderstood."""
    given = _object(body)
    expected = fields(command.parameters)
    known = [each.name for each in expected]
    known += command.phrases
    for name in given:
        if name not in known:
            takes = f"takes {', '.join(known)}" if known else "takes none"
            raise _fault(f"{_shown(name)}: {command.name} {takes}")
    for name in known:
        if name not in given:
            raise _fault(f"{name}: expected it in the object, as {command.name} takes {', '.join(known)}")
    phrases = [_phrase(name, given[name]) for name in command.phrases]
    for name, phrase in zip(command.phrases[:-1], phrases, strict=False):
        if BETWEEN_PHRASES in phrase:
            raise _fault(f"{name} = {_shown(phrase)}: expected no '{BETWEEN_PHRASES}' in it")
    words = [f" {BETWEEN_PHRASES} ".join(phrases)] if phrases else []
    for field in expected:
        words += _numbers(field, given[field.name])
    line = f"{command.name} : {' '.join(words)}" if words else command.name
    if len(line) > MAX_LINE_BYTES:
        raise _fault(f"more than the {MAX_LINE_BYTES} bytes of a line")
    return line.encode("ascii")


def reply_in_json(command: Command, reply: str) -> object:
    """A successful reply in JSON: a word, numbers by name, a list, an object, or text."""
    if command.reply_values:
        return dict(zip((each.name for each in command.reply_values), map(float, reply.split()), strict=True))
    if command.reply_list is not None:
        return [float(word) for word in reply.split()]
    if command.reply_words or reply[:1] not in ("{", "["):
        return reply
    return json.loads(reply)


def _object(body: bytes) -> dict[str, object]:
    if not body.strip():
        return {}
    try:
        return msgspec.json.decode(body, type=dict[str, object])
    except msgspec.DecodeError as fault:
        raise _fault(f"the body: expected an object in JSON ({fault})") from None
    except RecursionError:
        raise _fault("the body: expected fewer lists and objects within each other") from None


def _numbers(field: Field, value: object) -> list[str]:
    if field.length is None:
        return [_number(field.name, value)]
    if not isinstance(value, list) or len(value) != field.length:
        raise _fault(f"{field.name}: expected a list of {field.length} numbers")
    return [_number(f"{field.name}[{place}]", each) for place, each in enumerate(value)]


def _number(name: str, value: object) -> str:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _fault(f"{name}: expected a number")
    return repr(value)


def _phrase(name: str, value: object) -> str:
    if not isinstance(value, str) or not value.strip():
        raise _fault(f"{name}: expected a text that is not empty")
    if not (value.isascii() and value.isprintable()) or ":" in value:
        raise _fault(f"{name} = {_shown(value)}: expected printable ASCII without ':'")
    return value


def _fault(reason: str) -> NotUnderstood:
    return NotUnderstood(COMMUNICATION_FAILURE, harmless(reason))


def _shown(value: object) -> str:
    return shortened(repr(value), _LONGEST_SHOWN)


def _stem(quantity: Quantity) -> str:
    return quantity.name.rstrip("0123456789")
