"""Messages as JSON has them, and their checks.

The robot keeps every message in the form of ROS 2. A client of ROS 1 gets and sends the same message with
times as `{secs, nsecs}` and a `seq` in each header, which is 0. The definitions of messages that the robot
takes are files of `protocol/`.
"""

import re
from functools import cache
from importlib.resources import files
from types import GenericAlias
from typing import Annotated, Any

import msgspec

Message = dict[str, Any]
NS_PER_S = 1_000_000_000
FOLDERS = ("ros2", "rmi/ros2")
"""Folders of packages, below `protocol`."""
PRIMITIVES: dict[str, tuple[Any, Any]] = {
    "bool": (bool, False),
    "string": (str, ""),
    "float32": (float, 0.0),
    "float64": (float, 0.0),
    "int8": (Annotated[int, msgspec.Meta(ge=-(2**7), lt=2**7)], 0),
    "int32": (Annotated[int, msgspec.Meta(ge=-(2**31), lt=2**31)], 0),
    "uint16": (Annotated[int, msgspec.Meta(ge=0, lt=2**16)], 0),
    "uint32": (Annotated[int, msgspec.Meta(ge=0, lt=2**32)], 0),
}
"""Type and default of each primitive."""
_ROS1_NAMES = {"sec": "secs", "nanosec": "nsecs"}
_ROS2_NAMES = {"secs": "sec", "nsecs": "nanosec"}


class BadMessage(Exception):
    """A message does not fit its type, or its operation is refused. One line, for the client."""


def short_name(name: str) -> str:
    """Return package/Type for package/msg/Type, as ROS 1 names it; other names as they are."""
    return re.sub(r"/(msg|srv|action)/", "/", name)


def checked(content: Any, name: str) -> Any:
    """Return a message in the form of ROS 2 as an object, with defaults for missing fields.

    `name` is package/msg/Type, or package/srv/Type for a request, package/action/Type for a goal. Raises
    BadMessage for a field that is wrong or unknown.
    """
    try:
        return msgspec.convert(content, _struct_of(name))
    except (msgspec.ValidationError, RecursionError) as fault:
        raise BadMessage(str(fault)) from None


def to_ros1(value: Any) -> Any:
    """Return a message of ROS 2 in the form of ROS 1."""
    if isinstance(value, list):
        return [to_ros1(each) for each in value] if value and isinstance(value[0], dict) else value
    if not isinstance(value, dict):
        return value
    converted = {_ROS1_NAMES.get(name, name): to_ros1(each) for name, each in value.items()}
    return {"seq": 0, **converted} if value.keys() == {"stamp", "frame_id"} else converted


def from_ros1(value: Any) -> Any:
    """Return a message of ROS 1, of which fields may be missing, in the form of ROS 2."""
    if isinstance(value, list):
        return [from_ros1(each) for each in value] if value and isinstance(value[0], dict) else value
    if not isinstance(value, dict):
        return value
    return {_ROS2_NAMES.get(name, name): from_ros1(each) for name, each in value.items() if name != "seq"}


def time_of(ns: int) -> dict[str, int]:
    """Return a time or a duration (ns) as ROS 2 has it."""
    sec, nanosec = divmod(ns, NS_PER_S)
    return {"sec": sec, "nanosec": nanosec}


@cache
def _struct_of(name: str) -> type[msgspec.Struct]:
    """Return the class of a message, from the first part of its definition: request or goal."""
    package, kind, own = name.split("/")
    paths = [files("iiwa_sim.protocol").joinpath(each, f"{name}.{kind}") for each in FOLDERS]
    text = next(path for path in paths if path.is_file()).read_text(encoding="utf-8")
    fields: list[tuple[str, Any, Any]] = []
    for line in re.split(r"^---", text, flags=re.MULTILINE)[0].splitlines():
        words = line.partition("#")[0].split()
        if not words or "=" in line:  # a comment, or a constant
            continue
        element, bracket, _ = words[0].partition("[")
        if element in PRIMITIVES:
            found, default = PRIMITIVES[element]
        else:
            other, _, short = element.rpartition("/")
            found = _struct_of(f"{other or package}/msg/{short}")
            default = msgspec.field(default_factory=found)
        if bracket:
            found, default = GenericAlias(list, found), msgspec.field(default_factory=list)
        fields.append((words[1], found, default))
    return msgspec.defstruct(own, fields, forbid_unknown_fields=True, module=__name__)
