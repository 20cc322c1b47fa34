"""The definitions of ROS 2's interfaces that a robot has, as rosapi tells them.

They are read from protocol/: ros2_types.txt has those of ROS 2's own packages, ros2/ and rmi/ros2/ have
packages that can be built. Their form: https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html.
"""

import re
from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

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
_LIST, _SINGLE = 0, -1  # of fieldarraylen
_BETWEEN = "\n" + 80 * "=" + "\n"
_NAME = re.compile(r"(\w+)/(?:(msg|srv|action)/)?(\w+)")
_FIELD = re.compile(r"([\w/]+)(\[(\d*)\])?\s+(\w+)(\s+\S+)?")
_CONSTANT = re.compile(r"(\w+)\s+([A-Z]\w*)\s*=\s*(\S+)")


class Field(NamedTuple):
    """One line of a definition."""

    type: str
    """A primitive, or package/Type."""
    name: str
    length: int
    """Of a list: 0 where any is allowed. -1 where it is none."""


class Part(NamedTuple):
    """A message, or a part of a service or an action."""

    name: str
    """package/Type, package/Type_Request and so on."""
    text: str
    fields: tuple[Field, ...]
    constants: tuple[tuple[str, str], ...]


@cache
def interface(name: str) -> tuple[Part, ...]:
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


def details(part: Part) -> list[dict[str, Any]]:
    """A part, and all messages in it, each once: rosapi_msgs/TypeDef."""
    return [
        {
            "type": each.name,
            "fieldnames": [field.name for field in each.fields],
            "fieldtypes": [PRIMITIVES.get(field.type, (field.type, ""))[0] for field in each.fields],
            "fieldarraylen": [field.length for field in each.fields],
            "examples": [_example(field) for field in each.fields],
            "constnames": [name for name, _ in each.constants],
            "constvalues": [value for _, value in each.constants],
        }
        for each in _within(part)
    ]


def full_text(name: str) -> str:
    """The definition of a message and those of all messages in it in one text, as rosapi writes it."""
    first, *others = _within(interface(name)[0])
    return _BETWEEN.join([first.text, *(f"MSG: {each.name}\n{each.text}" for each in others)])


def _within(part: Part) -> Iterator[Part]:
    seen, waiting = {part.name}, [part]
    while waiting:
        each = waiting.pop(0)
        yield each
        for field in each.fields:
            if field.type not in PRIMITIVES and field.type not in seen:
                seen.add(field.type)
                waiting += interface(field.type)


def _example(field: Field) -> str:
    if field.length != _SINGLE:
        return "[]"
    return PRIMITIVES[field.type][1] if field.type in PRIMITIVES else "{}"


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


def _parsed(name: str, text: str, package: str) -> Part:
    fields, constants = [], []
    for line in text.splitlines():
        told = line.partition("#")[0].strip()
        constant, field = _CONSTANT.fullmatch(told), _FIELD.fullmatch(told)
        if constant is not None:
            constants.append((constant[2], constant[3]))
        elif field is not None:
            kind, brackets, length, own, _ = field.groups()
            whole = kind if kind in PRIMITIVES or "/" in kind else f"{package}/{kind}"
            fields.append(Field(whole, own, int(length or _LIST) if brackets else _SINGLE))
    return Part(name, text, tuple(fields), tuple(constants))
