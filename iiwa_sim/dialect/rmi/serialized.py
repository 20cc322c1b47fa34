"""Messages as the bytes that ROS 1 sends: https://wiki.ros.org/roscpp/Overview/MessagesSerializationAndAdaptingTypes.

Little-endian, one field after the other, without padding; strings and lists begin with their length.
"""

import struct
from typing import Any

from iiwa_sim.dialect.rmi.definitions import Definition, message

_FORMATS = {"bool": "?", "float32": "f", "float64": "d", "int8": "b", "int32": "i", "uint32": "I"}
_LENGTH = struct.Struct("<I")
_TIME = struct.Struct("<II")


def serialized(definition: Definition, content: dict[str, Any]) -> bytes:
    """A message of which all fields are given."""
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
        return struct.pack(f"<{_FORMATS[kind]}", value)
    if kind == "string":
        text: bytes = value.encode()
        return _LENGTH.pack(len(text)) + text
    if kind == "time":
        return _TIME.pack(value["secs"], value["nsecs"])
    return serialized(message(kind), value)
