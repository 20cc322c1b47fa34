"""The methods of Krc4 and AsyncKrc4, and the numbers of messages and errors, from the tables of protocol/.

This module adds what the table does not have: which values form one argument, and the names of arguments.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from iiwa_sim.dialect.krc4.table import Command, load_krc4_table
from iiwa_sim.dialect.wire.error_codes import load_error_codes
from tools.client_source.text import WIDTH, Argument, Kind, call, docs, kinds

FRAME = ("X mm", "Y mm", "Z mm", "A deg", "B deg", "C deg")
JOINTS = "A1 A2 .. of all axes (deg)"
FLAG = "1 on, 0 off"
NUMBERS = "krc4_numbers.py"
KINDS = kinds("krc4", "Krc4")

HEAD = '''"""The KRC4 messages, each as a method{kind}.

Written by `python -m tools.client_source` from protocol/krc4.toml: not to be changed by hand.
"""

from collections.abc import Sequence

from iiwa_sim.client.{module} import {base}
from iiwa_sim.client.exchange import exactly
from iiwa_sim.client.messages import KRC4, Message, Reply, as_axes, {readers}
from iiwa_sim.client.replies import Krc4Frame


class {name}({base}[Message, Reply]):
    """A robot of so many axes at the other end of a connection, one method per message."""

    _language = KRC4

    def __init__(self, host: str, port: int, timeout_s: float = 5.0, *, axes: int = 6) -> None:
        """`timeout_s` bounds the time to connect and the wait for each reply.

        No message tells how many axes the robot has. Raises ValueError for less than 1 or more than 10.
        """
        self._axes = as_axes(axes)
        super().__init__(host, port, timeout_s)
'''

NUMBERS_HEAD = '''"""What the numbers in KRC4 messages mean.

Written by `python -m tools.client_source` from protocol/krc4.toml and errors.toml: not to be changed by hand.
"""
'''


class Result(NamedTuple):
    """The return value of a method."""

    type: str
    read: str
    says: str


def arguments(command: Command) -> list[Argument]:
    """The arguments of a method; for a row of values, `sent` makes the reals of it."""
    if command.joints == "input":
        return [_row("joints_deg", "self._axes", JOINTS)]
    if tuple(command.inputs.values()) == FRAME:
        return [_row("target", "6", series(command.inputs))]
    found = []
    for register, meaning in command.inputs.items():
        if meaning == FLAG:
            found.append(Argument("on", "bool", "int(on)", ""))
        else:
            assert register == "I2", f"{command.tag} {register}: no name for this argument"
            found.append(Argument("number", "int", "number", f"number: {meaning}"))
    return found


def _row(name: str, count: str, says: str) -> Argument:
    return Argument(name, "Sequence[float]", f'exactly({count}, "{name}", {name})', f"{name}: {says}")


def result(command: Command) -> Result:
    """The return value of a command's method."""
    if command.joints == "output":
        return Result("tuple[float, ...]", "reals(tuple, self._axes)", JOINTS)
    if not command.outputs:
        return Result("None", "nothing", "")
    if tuple(command.outputs.values()) == FRAME:
        return Result("Krc4Frame", "reals(Krc4Frame._make, 6)", series(command.outputs))
    ((register, meaning),) = command.outputs.items()
    place = register[1:]
    if register.startswith("I"):
        return Result("bool", f"flag({place})", meaning.replace("1 ", "True ").replace("0 ", "False "))
    return Result("float", f"real({place})", series(command.outputs))


def series(registers: Mapping[str, str]) -> str:
    """Names and units, as in `X Y Z (mm) A B C (deg)`."""
    words: list[str] = []
    pairs = [meaning.rsplit(" ", 1) for meaning in registers.values()]
    for index, (name, unit) in enumerate(pairs):
        words.append(name)
        if index + 1 == len(pairs) or pairs[index + 1][1] != unit:
            words.append(f"({unit})")
    return " ".join(words)


def method(command: Command, kind: Kind) -> str:
    """The source of one method."""
    given, returned = arguments(command), result(command)
    signature = call(
        f"    {kind.define} {command.tag.lower()}",
        ["self", *(f"{each.name}: {each.type}" for each in given)],
        f" -> {returned.type}:",
    )
    says = [each.says for each in given if each.says]
    told = docs(command.summary, says + ([f"returns {returned.says}"] if returned.says else []))
    parts = [returned.read, f'"{command.tag}"']
    if any(each.type == "Sequence[float]" for each in given):
        parts += [f"reals={each.sent}" for each in given]
    elif given:
        parts.append(f"integers=[{', '.join(each.sent for each in given)}]")
    verb = "" if returned.type == "None" else "return "
    body = f"        {verb}{kind.wait}self._do({call('message', parts, '')})"
    assert len(body) <= WIDTH, body
    return f"{signature}\n{told}\n{body}\n"


def source(kind: Kind) -> str:
    """The text of one client's file."""
    commands = list(load_krc4_table().commands.values())
    readers = {result(each).read.partition("(")[0] for each in commands}
    head = HEAD.format(
        kind=kind.says,
        base=kind.base,
        module=kind.module,
        name=kind.name,
        readers=", ".join(sorted({*readers, "message"})),
    )
    return head + "".join(f"\n{method(each, kind)}" for each in commands)


def numbers_source() -> str:
    """The text of the file of numbers."""
    table = load_krc4_table()
    ids = [f'    "{each.tag}": {each.id},' for each in table.commands.values()]
    errors = [f'    {code}: "{row.meaning}",' for code, row in load_error_codes().items()]
    return "\n".join([NUMBERS_HEAD, "COMMANDS = {", *ids, "}", "", "ERRORS = {", *errors, "}", ""])
