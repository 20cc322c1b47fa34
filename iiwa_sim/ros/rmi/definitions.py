"""The message and service definitions of protocol/rmi: fields, MD5 sums, and types that check what comes in.

The definitions are those of ROS 1: https://wiki.ros.org/msg, https://wiki.ros.org/srv.
"""

import re
from collections.abc import Iterator
from functools import cache
from hashlib import md5
from importlib.resources import files
from typing import Annotated, Any, NamedTuple

from msgspec import Meta, Struct

from iiwa_sim.ros.conventions import RESULT_CONSTANTS
from iiwa_sim.ros.rmi.message_text import TYPES, Definition, joined, parsed, struct_of, within


class Time(Struct, forbid_unknown_fields=True):
    """A point in time as ROS 1 has it, since 1970."""

    secs: Annotated[int, Meta(ge=0, le=2**32 - 1)] = 0
    nsecs: Annotated[int, Meta(ge=0, le=2**32 - 1)] = 0


PRIMITIVES: dict[str, tuple[Any, Any]] = {**TYPES, "time": (Time, None)}
"""Type and default of each primitive type."""

RESULT = "robot_movement_interface/Result"

_NAME = re.compile(r"\w+/\w+")


class Service(NamedTuple):
    """What is asked, and what is answered."""

    name: str
    """package/Type"""
    request: Definition
    response: Definition


@cache
def message(name: str) -> Definition:
    """The definition of package/Type. Raises KeyError where there is none."""
    package, kind = _split(name)
    return _parsed(name, _text(package, "msg", kind), package)


@cache
def result_message(year: int) -> Definition:
    """The definition of Result in the package of a year: the first constants of today's."""
    today = message(RESULT)
    constants = [
        f"{kind} {name} = {value}" for kind, name, value in today.constants[: RESULT_CONSTANTS[year]]
    ]
    fields = [line for line in today.text.splitlines() if "=" not in line]
    return _parsed(RESULT, "".join(f"{line}\n" for line in (*constants, *fields)), "robot_movement_interface")


@cache
def service(name: str) -> Service:
    """The definition of package/Type. Raises KeyError where there is none."""
    package, kind = _split(name)
    request, response = re.split(r"^---\n", _text(package, "srv", kind), flags=re.MULTILINE)
    return Service(
        name, _parsed(f"{name}Request", request, package), _parsed(f"{name}Response", response, package)
    )


def message_md5(name: str) -> str:
    """The sum of the message package/Type that both ends of a ROS 1 topic compare."""
    return definition_md5(message(name))


def definition_md5(definition: Definition) -> str:
    """The sum of a message that both ends of a ROS 1 topic compare."""
    return md5(_summed(definition).encode()).hexdigest()  # not for security


def service_md5(name: str) -> str:
    """The sum that both ends of a ROS 1 service compare."""
    both = service(name)
    return md5((_summed(both.request) + _summed(both.response)).encode()).hexdigest()


@cache
def type_of(definition: Definition) -> type[Struct]:
    """The class for such messages."""
    return struct_of(definition, lambda kind: type_of(message(kind)), PRIMITIVES)


def parts(definition: Definition) -> Iterator[Definition]:
    """The definition, and those of all messages in it, each once."""
    return within(definition, message, PRIMITIVES)


def full_text(*definitions: Definition) -> str:
    """The definitions and those of all messages in them in one text, as the tools of ROS write it."""
    return joined({part.name: part for each in definitions for part in parts(each)}.values())


def _split(name: str) -> tuple[str, str]:
    if _NAME.fullmatch(name) is None:
        raise KeyError(name)
    package, _, kind = name.partition("/")
    return package, kind


def _text(package: str, kind: str, name: str) -> str:
    path = files("iiwa_sim.protocol").joinpath("rmi", package, kind, f"{name}.{kind}")
    try:
        return path.read_text(encoding="utf-8")
    except OSError:
        raise KeyError(f"{package}/{name}") from None


def _parsed(name: str, text: str, package: str) -> Definition:
    return parsed(name, text, lambda kind: _whole_name(kind, package))


def _whole_name(kind: str, package: str) -> str:
    if kind in PRIMITIVES or "/" in kind:
        return kind
    return "std_msgs/Header" if kind == "Header" else f"{package}/{kind}"


def _summed(definition: Definition) -> str:
    """The text whose MD5 sum is taken: constants, then fields, with the sums of messages in place of their
    types."""
    lines = [f"{kind} {name}={value}" for kind, name, value in definition.constants]
    for each in definition.fields:
        if each.type in PRIMITIVES:
            lines.append(f"{each.type}{'[]' if each.is_list else ''} {each.name}")
        else:
            lines.append(f"{message_md5(each.type)} {each.name}")
    return "\n".join(lines)
