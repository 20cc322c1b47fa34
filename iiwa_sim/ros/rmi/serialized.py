"""Messages as the bytes that ROS 1 sends: https://wiki.ros.org/roscpp/Overview/MessagesSerializationAndAdaptingTypes.

Little-endian, one field after the other, without padding; strings and lists begin with their length.
"""

import struct
from collections.abc import Generator
from typing import Any

from numpy import float32

from iiwa_sim.ros.rmi.definitions import message
from iiwa_sim.ros.rmi.message_text import Definition, Field

_FORMATS = {"bool": "?", "float32": "f", "float64": "d", "int8": "b", "int32": "i", "uint32": "I"}
_STRUCTS = {kind: struct.Struct(f"<{form}") for kind, form in _FORMATS.items()}
_LENGTH = struct.Struct("<I")
_TIME = struct.Struct("<II")

Steps = Generator[None, None, dict[str, Any]]
"""A generator that yields between steps and returns a message."""


class NoSuchMessage(Exception):
    """The bytes are no message of the type."""


def serialized(definition: Definition, content: dict[str, Any]) -> bytes:
    """The bytes of a message, all of whose fields are given."""
    found: list[bytes] = []
    for field in definition.fields:
        value = content[field.name]
        if not field.is_list:
            found.append(_one(field.type, value))
            continue
        found.append(_LENGTH.pack(len(value)))
        if field.type in _FORMATS:
            found.append(struct.pack(f"<{len(value)}{_FORMATS[field.type]}", *value))
        else:
            found.extend(_one(field.type, each) for each in value)
    return b"".join(found)


def _one(kind: str, value: Any) -> bytes:
    if kind in _FORMATS:
        return _STRUCTS[kind].pack(value)
    if kind == "string":
        text: bytes = value.encode()
        return _LENGTH.pack(len(text)) + text
    if kind == "time":
        return _TIME.pack(value["secs"], value["nsecs"])
    return serialized(message(kind), value)


def deserialized(definition: Definition, data: bytes) -> Steps:
    """Parse a message of ROS 1 in steps, one for each element of a list of messages, as lists may be long.

    Raises NoSuchMessage.
    """
    reader = _Reader(data)
    try:
        content = yield from reader.message_in_steps(definition)
    except (struct.error, UnicodeDecodeError):
        raise NoSuchMessage from None
    if reader.place != len(data):
        raise NoSuchMessage
    return content


class _Reader:
    """Reads values in order. Raises struct.error at the end of the data, and UnicodeDecodeError."""

    def __init__(self, data: bytes) -> None:
        self.place = 0
        self._data = data

    def message_in_steps(self, definition: Definition) -> Steps:
        content = dict[str, Any]()
        for field in definition.fields:
            if field.is_list and "/" in field.type:
                elements: list[Any] = []
                for _ in range(self._length()):
                    elements.append(self._message(field.type))
                    yield
                content[field.name] = elements
            else:
                content[field.name] = self._field(field)
        return content

    def _field(self, field: Field) -> Any:
        if not field.is_list:
            return self._one(field.type)
        length = self._length()
        if field.type not in _FORMATS:
            return [self._one(field.type) for _ in range(length)]
        if not length:
            return []
        values = self._unpacked(struct.Struct(f"<{length}{_FORMATS[field.type]}"))
        return [_meant(value) for value in values] if field.type == "float32" else list(values)

    def _one(self, kind: str) -> Any:
        if kind == "string":
            begin = self.place + _LENGTH.size
            self.place = begin + self._length()
            if self.place > len(self._data):
                raise struct.error
            return self._data[begin : self.place].decode()
        if kind == "time":
            secs, nsecs = self._unpacked(_TIME)
            return {"secs": secs, "nsecs": nsecs}
        if kind in _STRUCTS:
            (value,) = self._unpacked(_STRUCTS[kind])
            return _meant(value) if kind == "float32" else value
        return self._message(kind)

    def _length(self) -> int:
        length: int
        (length,) = self._unpacked(_LENGTH)
        if length > len(self._data) - self.place:  # each element takes one byte at least
            raise struct.error
        return length

    def _unpacked(self, form: struct.Struct) -> tuple[Any, ...]:
        values = form.unpack_from(self._data, self.place)
        self.place += form.size
        return values

    def _message(self, kind: str) -> dict[str, Any]:
        return {field.name: self._field(field) for field in message(kind).fields}


def _meant(value: float) -> float:
    """The shortest decimal that a float32 stands for: 0.1, not 0.10000000149, which may exceed a limit."""
    return float(str(float32(value)))
