"""Definitions of messages as ROS writes them: a field or a constant in each line, in ROS 1 and 2 alike."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import GenericAlias
from typing import Annotated, Any, NamedTuple

import msgspec

LIST, SINGLE = 0, -1
"""Lengths of a field that is a list of any length, and of one that is no list, as rosapi tells them."""
TYPES: dict[str, tuple[Any, Any]] = {
    "bool": (bool, False),
    "string": (str, ""),
    "float32": (float, 0.0),
    "float64": (float, 0.0),
    **{
        f"{sign}int{bits}": (Annotated[int, msgspec.Meta(ge=low, le=low + 2**bits - 1)], 0)
        for bits in (8, 16, 32)
        for sign, low in (("", -(2 ** (bits - 1))), ("u", 0))
    },
}
"""Type and default of each primitive type."""
_BETWEEN = "\n" + 80 * "=" + "\n"
_FIELD = re.compile(r"([\w/]+)(\[(\d*)\])?\s+(\w+)(\s+\S+)?")
_CONSTANT = re.compile(r"(\w+)\s+([A-Z]\w*)\s*=\s*(\S+)")


class Field(NamedTuple):
    """A field of a message."""

    type: str
    """A primitive, or package/Type; of a list that of one element."""
    name: str
    length: int
    """The length of a list; `LIST` where it may have any, `SINGLE` where the field is no list."""

    @property
    def is_list(self) -> bool:
        """Whether the field is a list, of whatever length."""
        return self.length != SINGLE


class Constant(NamedTuple):
    """A constant of a message. All of it is text, as the definition has it."""

    type: str
    name: str
    value: str


class Definition(NamedTuple):
    """A message, or a part of a service or an action."""

    name: str
    """package/Type, package/Type_Request and so on."""
    text: str
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...]


def parsed(name: str, text: str, whole_name: Callable[[str], str]) -> Definition:
    """The definition in a text; `whole_name` makes a type as it stands there one of `Field`."""
    fields, constants = [], []
    for line in text.splitlines():
        told = line.partition("#")[0].strip()
        constant, field = _CONSTANT.fullmatch(told), _FIELD.fullmatch(told)
        if constant is not None:
            constants.append(Constant(*constant.groups()))
        elif field is not None:
            kind, brackets, length, own, _ = field.groups()
            fields.append(Field(whole_name(kind), own, int(length or LIST) if brackets else SINGLE))
    return Definition(name, text, tuple(fields), tuple(constants))


class BadMessage(Exception):
    """A message does not fit its type. One line, with the place."""


def struct_of(
    definition: Definition,
    message: Callable[[str], type[msgspec.Struct]],
    primitives: Mapping[str, tuple[Any, Any]],
) -> type[msgspec.Struct]:
    """A class for such messages: missing fields get the defaults of ROS, unknown ones are refused.

    `message` gives the class of a type of message, `primitives` type and default of all others; a default of
    None stands for one that the type makes.
    """
    fields: list[tuple[str, Any, Any]] = []
    for each in definition.fields:
        kind, default = primitives.get(each.type) or (message(each.type), None)
        if each.is_list:
            fields.append((each.name, GenericAlias(list, kind), msgspec.field(default_factory=list)))
        elif default is None:
            fields.append((each.name, kind, msgspec.field(default_factory=kind)))
        else:
            fields.append((each.name, kind, default))
    name = definition.name.split("/")[1]
    return msgspec.defstruct(name, fields, forbid_unknown_fields=True, module=__name__)


def converted(content: Any, kind: type[msgspec.Struct]) -> Any:
    """A message of a class of `struct_of`. Raises BadMessage."""
    try:
        return msgspec.convert(content, kind)
    except (msgspec.ValidationError, RecursionError) as fault:
        raise BadMessage(str(fault)) from None


def within(
    definition: Definition, message: Callable[[str], Definition], primitives: Iterable[str]
) -> Iterator[Definition]:
    """The definition, and those of all messages in it, each once; `message` gives that of a type."""
    seen, waiting = {*primitives, definition.name}, [definition]
    while waiting:
        each = waiting.pop(0)
        yield each
        for field in each.fields:
            if field.type not in seen:
                seen.add(field.type)
                waiting.append(message(field.type))


def joined(definitions: Iterable[Definition]) -> str:
    """Several definitions in one text, as the tools of ROS write it."""
    first, *others = definitions
    return _BETWEEN.join([first.text, *(f"MSG: {each.name}\n{each.text}" for each in others)])


def typedef(definition: Definition, primitives: Mapping[str, tuple[str, str]]) -> dict[str, Any]:
    """A definition as rosapi tells it (TypeDef); `primitives` are their names there, and their defaults."""
    fields, constants = definition.fields, definition.constants
    examples = (primitives.get(field.type, ("", "{}"))[1] for field in fields)
    return {
        "type": definition.name,
        "fieldnames": [field.name for field in fields],
        "fieldtypes": [primitives.get(field.type, (field.type, ""))[0] for field in fields],
        "fieldarraylen": [field.length for field in fields],
        "examples": ["[]" if field.is_list else one for field, one in zip(fields, examples, strict=True)],
        "constnames": [each.name for each in constants],
        "constvalues": [each.value for each in constants],
    }
