"""Definitions of messages, and messages as JSON has them.

The robot keeps every message in the form of ROS 2. A client of ROS 1 gets and sends the same message with
times as `{secs, nsecs}` and a number `seq` in each header. The definitions are files of `protocol/`.
"""

import re
from functools import cache
from importlib.resources import files
from types import GenericAlias
from typing import Annotated, Any, NamedTuple

import msgspec

Message = dict[str, Any]
NS_PER_S = 1_000_000_000
PARTS = {"msg": ("",), "srv": ("_Request", "_Response"), "action": ("_Goal", "_Result", "_Feedback")}
"""Suffixes of the parts of an interface."""
LIST, SINGLE = 0, -1
"""Lengths of a field that is a list of any length, and of one that is no list, as rosapi tells them."""
_TYPES: dict[str, tuple[Any, Any]] = {"bool": (bool, False), "string": (str, "")}
_TYPES |= dict.fromkeys(("float32", "float64"), (float, 0.0)) | {"byte": (bytes, b"\x00")}
for _bits in (8, 16, 32, 64):
    for _name, _low in ((f"int{_bits}", -(2 ** (_bits - 1))), (f"uint{_bits}", 0)):
        _range = msgspec.Meta(ge=_low, le=_low + 2**_bits - 1) if _bits < 64 else None
        _TYPES[_name] = Annotated[int, _range], 0
"""Type and default of each primitive."""
_FIELD = re.compile(r"([\w/]+)(\[(\d*)\])?\s+(\w+)(\s+\S+)?")
_CONSTANT = re.compile(r"(\w+)\s+([A-Z]\w*)\s*=\s*(\S+)")


class BadMessage(Exception):
    """A message does not fit its type, or its operation is refused. One line, for the client."""


class Field(NamedTuple):
    """A field of a message."""

    type: str
    """A primitive, or package/Type; of a list that of one element."""
    name: str
    length: int
    """The length of a list, or `LIST`, or `SINGLE`."""


class Definition(NamedTuple):
    """A message, or a part of a service or an action."""

    name: str
    fields: tuple[Field, ...]
    constants: tuple[tuple[str, str], ...]
    """Name and value of each."""

    @property
    def details(self) -> list[Message]:
        """This definition and those of all messages in it, each once, as a rosapi/TypeDef."""
        found = [self]
        for each in found:  # it grows
            for kind in dict.fromkeys(field.type for field in each.fields if "/" in field.type):
                if kind not in [other.name for other in found]:
                    found.append(interface(kind, "msg")[0])
        return [
            {
                "type": each.name,
                "fieldnames": [field.name for field in each.fields],
                "fieldtypes": [field.type for field in each.fields],
                "fieldarraylen": [field.length for field in each.fields],
                "examples": [""] * len(each.fields),
                "constnames": [name for name, _ in each.constants],
                "constvalues": [value for _, value in each.constants],
            }
            for each in found
        ]


@cache
def interface(name: str, kind: str) -> tuple[Definition, ...]:
    """Return the definitions of a message, or of the parts of a service or an action.

    Args:
        name: package/Type or, with the kind in it, package/msg/Type.
        kind: msg, srv or action.

    Raises:
        KeyError: There is no such interface.
    """
    named = re.fullmatch(rf"(\w+)/(?:{kind}/)?(\w+)", name)
    if named is None:
        raise KeyError(name)
    package, own = named.groups()
    texts = re.split(r"^---\n?", _text(package, kind, own), flags=re.MULTILINE)
    return tuple(
        _parsed(f"{package}/{own}{suffix}", text, package)
        for suffix, text in zip(PARTS[kind], texts, strict=True)
    )


def short_name(name: str) -> str:
    """Return package/Type for package/msg/Type, as ROS 1 names it; other names as they are."""
    parts = name.split("/")
    return f"{parts[0]}/{parts[2]}" if len(parts) == 3 and parts[1] in PARTS else name


def checked(content: Any, name: str, kind: str = "msg") -> Any:
    """Return a message in the form of ROS 2 as an object with defaults for missing fields.

    Raises BadMessage for wrong and unknown fields. Of services and actions it is the first part.
    """
    try:
        return msgspec.convert(content, _struct_of(name, kind))
    except (msgspec.ValidationError, RecursionError) as fault:
        raise BadMessage(str(fault)) from None


def to_ros1(value: Any, seq: int = 0) -> Any:
    """Return a message of ROS 2 in the form of ROS 1; `seq` is the number for its headers."""
    if isinstance(value, list):
        return [to_ros1(each, seq) for each in value] if value and isinstance(value[0], dict) else value
    if not isinstance(value, dict):
        return value
    if value.keys() == {"sec", "nanosec"}:
        return {"secs": value["sec"], "nsecs": value["nanosec"]}
    told = {name: to_ros1(each, seq) for name, each in value.items()}
    return {"seq": seq, **told} if value.keys() == {"stamp", "frame_id"} else told


def from_ros1(value: Any) -> Any:
    """Return a message of ROS 1, of which fields may be missing, in the form of ROS 2."""
    if isinstance(value, list):
        return [from_ros1(each) for each in value] if value and isinstance(value[0], dict) else value
    if not isinstance(value, dict):
        return value
    if value and value.keys() <= {"secs", "nsecs"}:
        return {{"secs": "sec", "nsecs": "nanosec"}[name]: each for name, each in value.items()}
    is_header = value.keys() <= {"seq", "stamp", "frame_id"}
    return {name: from_ros1(each) for name, each in value.items() if not (is_header and name == "seq")}


def time_of(ns: int) -> dict[str, int]:
    """Return a time or a duration (ns) as ROS 2 has it."""
    sec, nanosec = divmod(ns, NS_PER_S)
    return {"sec": sec, "nanosec": nanosec}


def _text(package: str, kind: str, own: str) -> str:
    for folder in (("ros2",), ("rmi", "ros2")):
        path = files("iiwa_sim.protocol").joinpath(*folder, package, kind, f"{own}.{kind}")
        if path.is_file():
            return path.read_text(encoding="utf-8")
    name = f"{package}/{kind}/{own}"
    if name not in _common():
        raise KeyError(f"{package}/{own}")
    return _common()[name]


@cache
def _common() -> dict[str, str]:
    """The interfaces of ROS 2's own packages, by name."""
    text = files("iiwa_sim.protocol").joinpath("ros2_types.txt").read_text(encoding="utf-8")
    sections = (each.partition("\n") for each in re.split(r"^== ", text, flags=re.MULTILINE)[1:])
    return {name: told for name, _, told in sections}


def _parsed(name: str, text: str, package: str) -> Definition:
    fields: list[Field] = []
    constants: list[tuple[str, str]] = []
    for line in text.splitlines():
        told = line.partition("#")[0].strip()
        if (constant := _CONSTANT.fullmatch(told)) is not None:
            constants.append((constant[2], constant[3]))
        elif (field := _FIELD.fullmatch(told)) is not None:
            kind, brackets, length, own, _ = field.groups()
            if kind not in _TYPES and "/" not in kind:
                kind = f"{package}/{kind}"
            fields.append(Field(kind, own, int(length or LIST) if brackets else SINGLE))
    return Definition(name, tuple(fields), tuple(constants))


@cache
def _struct_of(name: str, kind: str) -> type[msgspec.Struct]:
    fields: list[tuple[str, Any, Any]] = []
    for each in interface(name, kind)[0].fields:
        found, default = _TYPES.get(each.type) or (_struct_of(each.type, "msg"), None)
        if each.length != SINGLE:
            fields.append((each.name, GenericAlias(list, found), msgspec.field(default_factory=list)))
        elif default is None:
            fields.append((each.name, found, msgspec.field(default_factory=found)))
        else:
            fields.append((each.name, found, default))
    own = name.rpartition("/")[2]
    return msgspec.defstruct(own, fields, forbid_unknown_fields=True, module=__name__)
