"""Definitions of messages in ROS 1 and ROS 2, and messages as JSON has them.

The robot keeps every message in the form of ROS 2. A client of ROS 1 gets and sends the same message with
times as `{secs, nsecs}` and a number `seq` in each header. The definitions are files of `protocol/`.
"""

import re
import struct
from functools import cache
from importlib.resources import files
from types import GenericAlias
from typing import Annotated, Any, NamedTuple

import msgspec

Message = dict[str, Any]
NS_PER_S = 1_000_000_000
RESULT_CONSTANTS = {2016: 0, 2021: 10, 2023: 13, 2024: 14}
"""Number of constants of robot_movement_interface's message Result, by the year of the package.

Constants count in the MD5 sum that both ends of a ROS 1 topic compare.
"""
PARTS = {"msg": ("",), "srv": ("_Request", "_Response"), "action": ("_Goal", "_Result", "_Feedback")}
"""Suffixes that ROS 2 gives the parts of an interface."""
LIST, SINGLE = 0, -1
"""Lengths of a field that is a list of any length, and of one that is no list, as rosapi tells them."""
_TYPES: dict[str, tuple[Any, Any]] = {"bool": (bool, False), "string": (str, "")}
_TYPES |= dict.fromkeys(("float32", "float64"), (float, 0.0)) | {"byte": (bytes, b"\x00")}
for _bits in (8, 16, 32, 64):
    for _name, _low in ((f"int{_bits}", -(2 ** (_bits - 1))), (f"uint{_bits}", 0)):
        _range = msgspec.Meta(ge=_low, le=_low + 2**_bits - 1) if _bits < 64 else None
        _TYPES[_name] = Annotated[int, _range], 0
"""Type and default of each primitive."""
_NAMES_IN_ROS2 = {"bool": "boolean", "byte": "octet", "float32": "float", "float64": "double"}
_FORMATS = {"bool": "?", "float32": "f", "float64": "d", "int8": "b", "int32": "i", "uint32": "I"}
_BETWEEN = "\n" + 80 * "=" + "\n"
_FIELD = re.compile(r"([\w/]+)(\[(\d*)\])?\s+(\w+)(\s+\S+)?")
_CONSTANT = re.compile(r"(\w+)\s+([A-Z]\w*)\s*=\s*(\S+)")


class BadMessage(Exception):
    """A message does not fit its type. One line, with the place."""


class Field(NamedTuple):
    """A field of a message."""

    type: str
    """A primitive, or package/Type; of a list that of one element."""
    name: str
    length: int
    """The length of a list, or `LIST`, or `SINGLE`."""

    @property
    def is_list(self) -> bool:
        return self.length != SINGLE


class Definition(NamedTuple):
    """A message, or a part of a service or an action."""

    name: str
    text: str
    fields: tuple[Field, ...]
    constants: tuple[tuple[str, str, str], ...]
    """Type, name and value of each."""
    ros2: bool

    @property
    def within(self) -> "list[Definition]":
        """This definition and those of all messages in it, each once."""
        found = {self.name: self}
        waiting = [self]
        while waiting:
            for field in waiting.pop(0).fields:
                if "/" in field.type and field.type not in found:
                    found[field.type] = interface(field.type, "msg", ros2=self.ros2)[0]
                    waiting.append(found[field.type])
        return list(found.values())

    @property
    def full_text(self) -> str:
        """The texts of `within` in one, as the tools of ROS write it."""
        first, *others = self.within
        return _BETWEEN.join([first.text, *(f"MSG: {each.name}\n{each.text}" for each in others)])

    @property
    def details(self) -> list[Message]:
        """Each definition of `within` as a rosapi/TypeDef."""
        names = _NAMES_IN_ROS2 if self.ros2 else {}
        return [
            {
                "type": each.name,
                "fieldnames": [field.name for field in each.fields],
                "fieldtypes": [names.get(field.type, field.type) for field in each.fields],
                "fieldarraylen": [field.length for field in each.fields],
                "examples": ["[]" if one.is_list else _example(one.type) for one in each.fields],
                "constnames": [name for _, name, _ in each.constants],
                "constvalues": [value for _, _, value in each.constants],
            }
            for each in self.within
        ]


@cache
def interface(name: str, kind: str, *, ros2: bool = True) -> tuple[Definition, ...]:
    """Return the definitions of a message, or of the parts of a service or an action.

    Args:
        name: package/Type or, with the kind in it, package/msg/Type.
        kind: msg, srv or action.
        ros2: Whether to return the definition of ROS 2 or that of ROS 1.

    Raises:
        KeyError: There is no such interface.
    """
    named = re.fullmatch(rf"(\w+)/(?:{kind}/)?(\w+)", name)
    if named is None:
        raise KeyError(name)
    package, own = named.groups()
    texts = re.split(r"^---\n?", _text(package, kind, own, ros2), flags=re.MULTILINE)
    suffixes = PARTS[kind] if ros2 else [each.replace("_", "") for each in PARTS[kind]]
    return tuple(
        _parsed(f"{package}/{own}{suffix}", text, package, ros2)
        for suffix, text in zip(suffixes, texts, strict=True)
    )


def short_name(name: str) -> str:
    """Return package/Type for package/msg/Type, as ROS 1 names it; other names as they are."""
    parts = name.split("/")
    return f"{parts[0]}/{parts[2]}" if len(parts) == 3 and parts[1] in PARTS else name


def result_text(year: int) -> str:
    """Return the full text of robot_movement_interface/Result for ROS 1 in the package of a year."""
    (today,) = interface("robot_movement_interface/Result", "msg", ros2=False)
    known = today.constants[: RESULT_CONSTANTS[year]]
    constants = [f"{kind} {name} = {value}" for kind, name, value in known]
    fields = [line for line in today.text.splitlines() if "=" not in line]
    own = "".join(f"{line}\n" for line in (*constants, *fields))
    return today._replace(text=own).full_text


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


def serialized(definition: Definition, content: Message) -> bytes:
    """Return the bytes of a message of ROS 1, all of whose fields are given.

    https://wiki.ros.org/roscpp/Overview/MessagesSerializationAndAdaptingTypes: little-endian, without
    padding; strings and lists begin with their length.
    """
    found: list[bytes] = []
    for field in definition.fields:
        value = content[field.name]
        if field.is_list:
            found.append(struct.pack("<I", len(value)))
        found.extend(_bytes_of(field.type, each) for each in (value if field.is_list else [value]))
    return b"".join(found)


def _bytes_of(kind: str, value: Any) -> bytes:
    if kind in _FORMATS:
        return struct.pack(f"<{_FORMATS[kind]}", value)
    if kind == "string":
        text: bytes = value.encode()
        return struct.pack("<I", len(text)) + text
    if kind == "time":
        return struct.pack("<II", value["secs"], value["nsecs"])
    return serialized(interface(kind, "msg", ros2=False)[0], value)


def _example(kind: str) -> str:
    return str(_TYPES[kind][1]) if kind in _TYPES else "{}"


def _text(package: str, kind: str, own: str, ros2: bool) -> str:
    protocol = files("iiwa_sim.protocol")
    for folder in ("ros2", "rmi/ros2") if ros2 else ("rmi",):
        path = protocol.joinpath(*folder.split("/"), package, kind, f"{own}.{kind}")
        if path.is_file():
            return path.read_text(encoding="utf-8")
    text = _common().get(f"{package}/{kind}/{own}") if ros2 else None
    if text is None:
        raise KeyError(f"{package}/{own}")
    return text


@cache
def _common() -> dict[str, str]:
    """The interfaces of ROS 2's own packages, by name."""
    text = files("iiwa_sim.protocol").joinpath("ros2_types.txt").read_text(encoding="utf-8")
    sections = (each.partition("\n") for each in re.split(r"^== ", text, flags=re.MULTILINE)[1:])
    return {name: told for name, _, told in sections}


def _parsed(name: str, text: str, package: str, ros2: bool) -> Definition:
    fields: list[Field] = []
    constants: list[tuple[str, str, str]] = []
    for line in text.splitlines():
        told = line.partition("#")[0].strip()
        constant, field = _CONSTANT.fullmatch(told), _FIELD.fullmatch(told)
        if constant is not None:
            constants.append((constant[1], constant[2], constant[3]))
        elif field is not None:
            kind, brackets, length, own, _ = field.groups()
            if kind == "Header":
                kind = "std_msgs/Header"
            elif kind not in _TYPES and kind != "time" and "/" not in kind:
                kind = f"{package}/{kind}"
            fields.append(Field(kind, own, int(length or LIST) if brackets else SINGLE))
    return Definition(name, text, tuple(fields), tuple(constants), ros2)


@cache
def _struct_of(name: str, kind: str) -> type[msgspec.Struct]:
    fields: list[tuple[str, Any, Any]] = []
    for each in interface(name, kind)[0].fields:
        found, default = _TYPES.get(each.type) or (_struct_of(each.type, "msg"), None)
        if each.is_list:
            fields.append((each.name, GenericAlias(list, found), msgspec.field(default_factory=list)))
        elif default is None:
            fields.append((each.name, found, msgspec.field(default_factory=found)))
        else:
            fields.append((each.name, found, default))
    own = name.rpartition("/")[2]
    return msgspec.defstruct(own, fields, forbid_unknown_fields=True, module=__name__)
