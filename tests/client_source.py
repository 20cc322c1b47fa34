"""The clients' methods, written from protocol/iiwa.toml: `python -m tests.client_source`.

Writes iiwa_sim/client/commands.py and async_commands.py; a test compares them with the table. What the table
does not say is here: which values go together as one argument, and what a row of values is read into.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from iiwa_sim.dialect.table import Command, Quantity, load_table

FOLDER = Path(__file__).parent.parent / "iiwa_sim" / "client"
WIDTH = 110

GROUPS = {
    "target": ("x", "y", "z", "alpha", "beta", "gamma"),
    "position": ("x", "y", "z"),
    "quaternion": ("qx", "qy", "qz", "qw"),
    "shift": ("dx", "dy", "dz", "dalpha", "dbeta", "dgamma"),
    "joints": tuple(f"j{i}" for i in range(7)),
    "speeds": tuple(f"v{i}" for i in range(7)),
    "force": ("fx", "fy", "fz", "tx", "ty", "tz"),
}
"""Values that are one argument, longest first where two begin alike."""

ROWS = {
    ("x", "y", "z", "alpha", "beta", "gamma"): "Frame",
    tuple(f"j{i}" for i in range(7)): "JointPosition",
    tuple(f"t{i}" for i in range(7)): "JointTorque",
    ("fx", "fy", "fz", "tx", "ty", "tz"): "CartesianForce",
    (
        "mode",
        "e_stopped",
        "drives_powered",
        "motion_possible",
        "in_motion",
        "in_error",
        "error_code",
    ): "RobotStatus",
}
"""The class of iiwa_sim.client.replies for the values of a reply."""

PROSE = {
    "help": ("str", "text"),
    "get error": ("LastError", "last_error"),
    "is reachable": ("Reachability", "reachability"),
    "is lin reachable": ("Reachability", "reachability"),
}
"""What a line of prose is read into, and by which reader."""

BY_HAND = {"bye"}
"""In blocking.py and asynchronous.py, since it also ends the connection."""

HEAD = '''"""The commands of the iiwa's line protocol, each as a method{kind}.

Written by `python -m tests.client_source` from protocol/iiwa.toml: not to be changed by hand.
"""

from collections.abc import Sequence

from iiwa_sim.client.{module} import {base}
from iiwa_sim.client.exchange import exactly, phrase, request
from iiwa_sim.client.readers import (
{readers}
)
from iiwa_sim.client.replies import (
{replies}
)


class {name}({base}):
    """A robot at the other end of a connection, one method per command."""
'''


class Kind(NamedTuple):
    """One of the two clients."""

    file: str
    name: str
    base: str
    module: str
    says: str
    define: str
    wait: str


KINDS = (
    Kind("commands.py", "Iiwa", "Connection", "blocking", "", "def", ""),
    Kind(
        "async_commands.py",
        "AsyncIiwa",
        "AsyncConnection",
        "asynchronous",
        " to be awaited",
        "async def",
        "await ",
    ),
)


class Argument(NamedTuple):
    """One argument of a method, and how it is put on the line."""

    name: str
    type: str
    sent: str
    says: str


def arguments(command: Command) -> list[Argument]:
    """The arguments of its method, in the order of the line."""
    found: list[Argument] = []
    quantities = list(command.parameters)
    while quantities:
        names = tuple(each.name for each in quantities)
        for group, members in GROUPS.items():
            if names[: len(members)] == members:
                says = f"{group}: {_series(quantities[: len(members)])}"
                sent = f'*exactly({len(members)}, "{group}", {group})'
                found.append(Argument(group, "Sequence[float]", sent, says))
                del quantities[: len(members)]
                break
        else:
            found.append(_single(quantities.pop(0)))
    for quantity in command.optional:
        name = quantity.name
        says = f"{name}, if given: {_range(quantity)}"
        sent = f"*([] if {name} is None else [{name}])"
        found.append(Argument(name, "float | None = None", sent, says))
    return found


def _single(quantity: Quantity) -> Argument:
    type_ = _type(quantity)
    name = quantity.name
    sent = f"int({name})" if type_ == "bool" else name
    return Argument(name, type_, sent, f"{name}: {_range(quantity)}")


def _type(quantity: Quantity) -> str:
    if not quantity.integer:
        return "float"
    return "bool" if (quantity.minimum, quantity.maximum) == (0, 1) else "int"


def _series(quantities: Sequence[Quantity]) -> str:
    """Names and units, as in `x y z (mm) alpha beta gamma (rad)`."""
    words: list[str] = []
    for index, each in enumerate(quantities):
        words.append(each.name)
        if index + 1 == len(quantities) or quantities[index + 1].unit != each.unit:
            words.append("(relative)" if each.name.startswith("v") else f"({each.unit})")
    return " ".join(words).replace(" (1)", "")


def _range(quantity: Quantity) -> str:
    unit = "" if quantity.unit == "1" else f" ({quantity.unit})"
    inequality = f", {quantity.range}" if quantity.range else ""
    return f"{quantity.meaning}{unit}{inequality}"


def result(command: Command) -> tuple[str, str]:
    """The type a method returns, and what reads it from the reply."""
    if command.name in PROSE:
        return PROSE[command.name]
    if command.reply_list is not None:
        return "tuple[bool, ...]", "states"
    if command.reply_words:
        if len(command.reply_words) == 1:
            return "None", f'nothing("{command.reply_words[0]}")'
        return "str", f"one_of({', '.join(repr(word) for word in command.reply_words)})".replace("'", '"')
    if len(command.reply_values) == 1:
        type_ = _type(command.reply_values[0])
        return type_, {"float": "number", "bool": "state", "int": "integer"}[type_]
    row = ROWS[tuple(each.name for each in command.reply_values)]
    whole = all(each.integer for each in command.reply_values)
    return row, f"{'integers' if whole else 'numbers'}({row}._make, {len(command.reply_values)})"


def method(command: Command, kind: Kind) -> str:
    """The source of one method."""
    name = command.name.replace(" ", "_")
    type_, reader = result(command)
    if command.phrase:
        given = [Argument(command.phrase, 'str = ""', command.phrase, "")]
        made = "phrase"
    else:
        given, made = arguments(command), "request"
    signature = _call(
        f"    {kind.define} {name}",
        ["self", *(f"{each.name}: {each.type}" for each in given)],
        f" -> {type_}:",
    )
    says = [each.says for each in given if each.says]
    docs = _docs(command.summary, says)
    asked = _call(f"{made}", [reader, f'"{command.name}"', *(each.sent for each in given)], "")
    verb = "" if type_ == "None" else "return "
    body = f"        {verb}{kind.wait}self._do({asked})"
    if len(body) > WIDTH:
        body = _call(
            f"        {verb}{kind.wait}self._do",
            [_call(made, [reader, f'"{command.name}"', *(each.sent for each in given)], "", indent=12)],
            "",
            force=True,
        )
    return f"{signature}\n{docs}\n{body}\n"


def _call(head: str, parts: list[str], tail: str, *, indent: int | None = None, force: bool = False) -> str:
    one = f"{head}({', '.join(parts)}){tail}"
    column = len(head) - len(head.lstrip()) if indent is None else indent
    if len(one) + (0 if indent is None else indent) <= WIDTH and not force:
        return one
    inner = " " * (column + 4)
    comma = "" if force else ","
    return f"{head}(\n" + ",\n".join(f"{inner}{part}" for part in parts) + f"{comma}\n{' ' * column}){tail}"


def _docs(summary: str, says: list[str]) -> str:
    if not says:
        lines = textwrap.wrap(f'"""{summary}"""', WIDTH - 8)
        return textwrap.indent("\n".join(lines), " " * 8)
    lines = [*textwrap.wrap(f'"""{summary}', WIDTH - 8), ""]
    for each in says:
        lines += textwrap.wrap(each, WIDTH - 8, subsequent_indent="    ")
    return textwrap.indent("\n".join([*lines, '"""']), " " * 8)


def source(kind: Kind) -> str:
    """The text of one client's file."""
    commands = [each for each in load_table("iiwa").commands.values() if each.name not in BY_HAND]
    readers = {result(each)[1].partition("(")[0] for each in commands}
    types = {result(each)[0] for each in commands} & {*ROWS.values(), "LastError", "Reachability"}
    head = HEAD.format(
        kind=kind.says,
        module=kind.module,
        base=kind.base,
        name=kind.name,
        readers="\n".join(f"    {each}," for each in sorted(readers)),
        replies="\n".join(f"    {each}," for each in sorted(types)),
    )
    return head + "".join(f"\n{method(each, kind)}" for each in commands)


def main() -> None:
    for kind in KINDS:
        (FOLDER / kind.file).write_text(source(kind))


if __name__ == "__main__":
    main()
