"""Generates the methods of Iiwa and AsyncIiwa from protocol/iiwa.toml.

This module adds what the table does not have: which values form one argument, and the types of replies.
"""

from __future__ import annotations

from collections.abc import Sequence

from iiwa_sim.dialect.wire.command import Command, Quantity
from iiwa_sim.dialect.wire.table_file import load_table
from tools.client_source.text import WIDTH, Argument, Kind, call, docs, kinds

GROUPS = {
    "target": ("x", "y", "z", "alpha", "beta", "gamma"),
    "position": ("x", "y", "z"),
    "centre": ("cx", "cy", "cz"),
    "quaternion": ("qx", "qy", "qz", "qw"),
    "shift": ("dx", "dy", "dz", "dalpha", "dbeta", "dgamma"),
    "joints": tuple(f"j{i}" for i in range(7)),
    "speeds": tuple(f"v{i}" for i in range(7)),
    "force": ("fx", "fy", "fz", "tx", "ty", "tz"),
}
"""Values that form one argument, longest first where two begin alike."""

ROWS = {
    ("x", "y", "z", "alpha", "beta", "gamma"): "Frame",
    tuple(f"j{i}" for i in range(7)): "JointPosition",
    tuple(f"t{i}" for i in range(7)): "JointTorque",
    ("fx", "fy", "fz", "tx", "ty", "tz"): "CartesianForce",
    ("max_force", "max_torque"): "CollisionThresholds",
    ("mass", "cx", "cy", "cz"): "ToolLoad",
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
"""The type of a reply of prose, and its reader."""

ENDS = {"bye"}
"""Commands after which the connection is closed."""

HEAD = '''"""The commands of the iiwa's line protocol, each as a method{kind}.

Written by `python -m tools.client_source` from protocol/iiwa.toml: not to be changed by hand.
"""

from collections.abc import Sequence

from iiwa_sim.client.{module} import {base}
from iiwa_sim.client.exchange import exactly
from iiwa_sim.client.lines import IIWA, phrase, request
from iiwa_sim.client.readers import (
{readers}
)
from iiwa_sim.client.replies import (
{replies}
)


class {name}({base}[str, str]):
    """A robot at the other end of a connection, one method per command."""

    _language = IIWA
'''

KINDS = kinds("iiwa", "Iiwa")


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
    """The return type of a method, and the reader of its reply."""
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
    signature = call(
        f"    {kind.define} {name}",
        ["self", *(f"{each.name}: {each.type}" for each in given)],
        f" -> {type_}:",
    )
    says = [each.says for each in given if each.says]
    told = docs(command.summary, says)
    asked = call(f"{made}", [reader, f'"{command.name}"', *(each.sent for each in given)], "")
    verb = "" if type_ == "None" else "return "
    body = f"        {verb}{kind.wait}self._do({asked})"
    if len(body) > WIDTH:
        body = call(
            f"        {verb}{kind.wait}self._do",
            [call(made, [reader, f'"{command.name}"', *(each.sent for each in given)], "", indent=12)],
            "",
            force=True,
        )
    if command.name in ENDS:
        body += "\n        self.close()"
    return f"{signature}\n{told}\n{body}\n"


def source(kind: Kind) -> str:
    """The text of one client's file."""
    commands = list(load_table("iiwa").commands.values())
    readers = {result(each)[1].partition("(")[0] for each in commands}
    types = {result(each)[0] for each in commands} & {*ROWS.values(), "LastError", "Reachability"}
    head = HEAD.format(
        kind=kind.says,
        base=kind.base,
        module=kind.module,
        name=kind.name,
        readers="\n".join(f"    {each}," for each in sorted(readers)),
        replies="\n".join(f"    {each}," for each in sorted(types)),
    )
    return head + "".join(f"\n{method(each, kind)}" for each in commands)
