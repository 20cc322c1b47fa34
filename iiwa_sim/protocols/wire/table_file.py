"""A protocol table, read from protocol/NAME.toml and checked."""

from functools import cache
from importlib.resources import files

import msgspec

from iiwa_sim.protocols.wire.command import Command, Quantity
from iiwa_sim.protocols.wire.table import Table


class TableError(Exception):
    """A protocol table is wrong. One line names file, key and what was expected."""


class _ValueRow(msgspec.Struct, forbid_unknown_fields=True):
    unit: str
    meaning: str
    above: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    integer: bool = False


class _ReplyRow(msgspec.Struct, forbid_unknown_fields=True):
    words: tuple[str, ...] = ()
    values: str = ""
    list: str = ""
    prose: bool = False


class _CommandRow(msgspec.Struct, forbid_unknown_fields=True):
    summary: str
    mode: str
    requirements: list[str]
    reply: _ReplyRow
    parameters: str = ""
    each_joint: str = ""
    optional: str = ""
    phrase: str = ""
    extension: bool = False


class _TableRows(msgspec.Struct, forbid_unknown_fields=True):
    title: str
    source: str
    value: dict[str, _ValueRow]
    command: dict[str, _CommandRow]


@cache
def load_table(name: str, joints: int = 0) -> Table:
    """The table protocol/NAME.toml, for a robot with `joints` joints.

    Raises TableError if the table is wrong, or if it depends on the number of joints and none was given.
    """
    text = files("iiwa_sim.protocol").joinpath(f"{name}.toml").read_bytes()
    return read_table(text, f"{name}.toml", joints)


def read_table(text: bytes, source: str, joints: int = 0) -> Table:
    """The table of a TOML text; `source` names the text in errors."""
    try:
        rows = msgspec.toml.decode(text, type=_TableRows)
    except msgspec.DecodeError as fault:
        raise TableError(f"{source}: {fault}") from None
    return Table(
        {name: _command(source, name, row, rows.value, joints) for name, row in rows.command.items()}
    )


def _command(source: str, name: str, row: _CommandRow, values: dict[str, _ValueRow], joints: int) -> Command:
    def quantities(key: str, names: str) -> tuple[Quantity, ...]:
        for each in names.split():
            if each not in values:
                raise TableError(f"{source}: command.{name}.{key}: {each} has no row in [value]")
        return tuple(Quantity(each, *msgspec.structs.astuple(values[each])) for each in names.split())

    if name != " ".join(name.lower().split()):
        raise TableError(f"{source}: command.{name}: expected a name in lower case with single blanks")
    parameters = quantities("parameters", row.parameters)
    if row.each_joint:
        listed = quantities("each_joint", row.each_joint)
        if len(listed) > 1 or parameters:
            raise TableError(f"{source}: command.{name}.each_joint: expected one value, and no parameters")
        if not joints:
            raise TableError(f"{source}: command.{name}.each_joint: expected to be told how many there are")
        parameters = tuple(listed[0]._replace(name=f"{listed[0].name}{place}") for place in range(joints))
    if row.optional and not row.parameters:
        raise TableError(f"{source}: command.{name}.optional: expected parameters, too")
    if row.optional and row.phrase:
        raise TableError(f"{source}: command.{name}.optional: expected no phrase with it")
    reply = row.reply
    if (bool(reply.words), bool(reply.values), bool(reply.list), reply.prose).count(True) != 1:
        raise TableError(f"{source}: command.{name}.reply: expected one of words, values, list, prose")
    listed = quantities("reply.list", reply.list)
    if len(listed) > 1:
        raise TableError(f"{source}: command.{name}.reply.list: expected one value")
    return Command(
        name=name,
        summary=row.summary,
        mode=row.mode,
        requirements=tuple(row.requirements),
        extension=row.extension,
        parameters=parameters,
        phrase=row.phrase,
        reply_words=reply.words,
        reply_values=quantities("reply.values", reply.values),
        optional=quantities("optional", row.optional),
        reply_list=listed[0] if listed else None,
    )
