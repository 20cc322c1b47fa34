"""The table of KRC4 messages, read from protocol/krc4.toml, and their ten integers and ten reals."""

from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from typing import Literal, NamedTuple

import msgspec

from iiwa_sim.protocols.krc4.stream import XML_BLANKS, Element
from iiwa_sim.protocols.wire.decimals import NotANumberError, format_decimals, parse_decimal, quoted
from iiwa_sim.protocols.wire.table_file import TableError

REGISTERS = 10
"""Integers, and as many reals: a robot with more axes has no place in a message."""
LARGEST_INTEGER = 2**31 - 1
SMALLEST_INTEGER = -(2**31)
REQUEST, REPLY = "Cmd", "Res"

_INTEGERS = tuple(f"I{place}" for place in range(REGISTERS))
_REALS = tuple(f"R{place}" for place in range(REGISTERS))
_PLACES = {name: place for names in (_INTEGERS, _REALS) for place, name in enumerate(names)}
_DIGITS = len(str(LARGEST_INTEGER))


class Message(NamedTuple):
    """A request or a reply with its numbers."""

    integers: tuple[int, ...]
    reals: tuple[float, ...]
    fault: str
    """Why it is malformed, empty if it is not. Integers and reals that could not be read are 0."""

    @property
    def id(self) -> int:
        """Id of the message, which the reply repeats."""
        return self.integers[0]

    @property
    def command(self) -> int:
        """Id of the command."""
        return self.integers[1]


class Command(NamedTuple):
    """One row of the table."""

    tag: str
    id: int
    summary: str
    requirements: tuple[str, ...]
    inputs: Mapping[str, str]
    """Meaning and unit of what it takes, by register."""
    outputs: Mapping[str, str]
    """Meaning and unit of what it answers, by register."""
    joints: Literal["", "input", "output"]
    """Whether it takes or answers joint positions (deg) in the reals, from R0 on."""


class Krc4Table(NamedTuple):
    commands: Mapping[int, Command]
    """Commands by their ids."""


class _CommandRow(msgspec.Struct, forbid_unknown_fields=True):
    id: int
    summary: str
    requirements: tuple[str, ...]
    inputs: dict[str, str] = {}
    outputs: dict[str, str] = {}
    joints: Literal["", "input", "output"] = ""


class _TableRows(msgspec.Struct, forbid_unknown_fields=True):
    title: str
    source: str
    command: dict[str, _CommandRow]


@cache
def load_krc4_table() -> Krc4Table:
    """The table; raises TableError where it is wrong."""
    return read_krc4_table(files("iiwa_sim.protocol").joinpath("krc4.toml").read_bytes())


def read_krc4_table(text: bytes) -> Krc4Table:
    """The table from its TOML text."""
    try:
        rows = msgspec.toml.decode(text, type=_TableRows)
    except msgspec.DecodeError as fault:
        raise TableError(f"krc4.toml: {fault}") from None
    commands: dict[int, Command] = {}
    for tag, row in rows.command.items():
        for register in (*row.inputs, *row.outputs):
            if register not in _PLACES or register in _INTEGERS[:2]:
                raise TableError(f"krc4.toml: command.{tag}: {register}: expected I2 to I9 or R0 to R9")
        if row.id in commands or row.id <= 0:
            raise TableError(f"krc4.toml: command.{tag}.id = {row.id}: expected a number of its own above 0")
        commands[row.id] = Command(
            tag, row.id, row.summary, row.requirements, row.inputs, row.outputs, row.joints
        )
    return Krc4Table(commands)


def understand(element: Element, root: str = REQUEST) -> Message:
    """The message in an XML element: a request, or a reply if the root is that of one."""
    fault = element.fault
    if not fault and element.name != root:
        fault = f"{_shown(element.name)}: expected {root}"
    integers, reals = [0] * REGISTERS, [0.0] * REGISTERS
    for name, value in element.values.items():
        text = value.strip(XML_BLANKS)
        place = _PLACES.get(name)
        if place is None:
            fault = fault or f"{_shown(name)}: expected I0 to I9 and R0 to R9"
            continue
        try:
            if name[0] == "I":
                integers[place] = _integer(text)
            else:
                reals[place] = parse_decimal(text.encode())
        except NotANumberError as wrong:
            fault = fault or f"{name} = {wrong}"
    return Message(tuple(integers), tuple(reals), fault)


def reply(integers: Sequence[int], reals: Sequence[float]) -> bytes:
    """The reply with these integers (from I0) and reals (from R0), zeros elsewhere. Raises ValueError for
    a value that is not finite."""
    numbers = [str(value).encode() for value in (*integers, *[0] * (REGISTERS - len(integers)))]
    decimals = format_decimals((*reals, *[0.0] * (REGISTERS - len(reals)))).split(b" ")
    named = zip((*_INTEGERS, *_REALS), (*numbers, *decimals), strict=True)
    body = b"".join([b"<%b>%b</%b>" % (name.encode(), value, name.encode()) for name, value in named])
    return b"<%b>%b</%b>" % (REPLY.encode(), body, REPLY.encode())


def _integer(text: str) -> int:
    digits = text.removeprefix("-") if text.startswith("-") else text.removeprefix("+")
    if digits.isascii() and digits.isdigit() and len(digits) <= _DIGITS:
        value = int(text)
        if SMALLEST_INTEGER <= value <= LARGEST_INTEGER:
            return value
    raise NotANumberError(f"{_shown(text)}: expected an integer from {SMALLEST_INTEGER} to {LARGEST_INTEGER}")


def _shown(text: str) -> str:
    return quoted(text.encode())
