"""The definitions of ROS 2's interfaces that a robot has: types that check messages, and what rosapi tells.

They are read from protocol/: ros2_types.txt has those of ROS 2's own packages, ros2/ and rmi/ros2/ have
packages that can be built. Their form: https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html.
"""

import re
from functools import cache
from importlib.resources import files
from typing import Any

from msgspec import Struct

from iiwa_sim.ros.rmi.message_text import TYPES, Definition, joined, parsed, struct_of, typedef, within

FOLDERS = ("ros2", "rmi/ros2")
COMMON = "ros2_types.txt"
PRIMITIVES = {
    "bool": ("boolean", "False"),
    "byte": ("octet", "b'\\x00'"),
    "float32": ("float", "0.0"),
    "float64": ("double", "0.0"),
    "string": ("string", ""),
    **{f"{sign}int{bits}": (f"{sign}int{bits}", "0") for sign in ("", "u") for bits in (8, 16, 32, 64)},
}
"""Name of each in what ROS 2 generates for Python, which rosapi tells, and its default."""


@cache
def interface(name: str) -> tuple[Definition, ...]:
    """A message (one part), a service (request, response) or an action (goal, result, feedback).

    Its name is package/msg/Type, package/srv/Type or package/action/Type; a message's also package/Type.
    Raises KeyError where there is none.
    """
    package, kind, own = split(name)
    words = {
        "msg": ("",),
        "srv": ("_Request", "_Response"),
        "action": ("_Goal", "_Result", "_Feedback"),
    }[kind]
    texts = re.split(r"^---\n?", _text(package, kind, own), flags=re.MULTILINE)
    return tuple(
        _parsed(f"{package}/{own}{word}", text, package) for word, text in zip(words, texts, strict=True)
    )


@cache
def type_of(name: str, part: int = 0) -> type[Struct]:
    """The class for messages of an interface, or of one of its parts. Raises KeyError where there is none."""
    return struct_of(interface(name)[part], type_of, TYPES)


def split(name: str) -> tuple[str, str, str]:
    """Package, kind and own name. Raises KeyError where it is no name of an interface."""
    parts = name.split("/")
    package, kind, own = (parts[0], "msg", parts[1]) if len(parts) == 2 else [*parts, "", ""][:3]
    if (
        len(parts) > 3
        or kind not in ("msg", "srv", "action")
        or not re.fullmatch(r"\w+/\w+", f"{package}/{own}")
    ):
        raise KeyError(name)
    return package, kind, own


def details(part: Definition) -> list[dict[str, Any]]:
    """A part, and all messages in it, each once: rosapi_msgs/TypeDef."""
    return [typedef(each, PRIMITIVES) for each in within(part, _message, PRIMITIVES)]


def full_text(name: str) -> str:
    """The definition of a message and those of all messages in it in one text, as rosapi writes it."""
    return joined(within(_message(name), _message, PRIMITIVES))


def _message(name: str) -> Definition:
    return interface(name)[0]


def _text(package: str, kind: str, own: str) -> str:
    protocol = files("iiwa_sim.protocol")
    for folder in FOLDERS:
        path = protocol.joinpath(*folder.split("/"), package, kind, f"{own}.{kind}")
        if path.is_file():
            return path.read_text(encoding="utf-8")
    return _common()[f"{package}/{kind}/{own}"]


@cache
def _common() -> dict[str, str]:
    text = files("iiwa_sim.protocol").joinpath(COMMON).read_text(encoding="utf-8")
    sections = (each.partition("\n") for each in re.split(r"^== ", text, flags=re.MULTILINE)[1:])
    return {name: told for name, _, told in sections}


def _parsed(name: str, text: str, package: str) -> Definition:
    return parsed(name, text, lambda kind: kind if kind in PRIMITIVES or "/" in kind else f"{package}/{kind}")
