"""Encodes a message of a topic for a client of rosbridge, in the `compression` that it asks for.

Text frames are str, binary ones bytes. Needs the library cbor2.
"""

import struct
from collections.abc import Callable
from typing import Any

import msgspec
from cbor2 import CBORTag, dumps

from iiwa_sim.ros.rmi.definitions import message
from iiwa_sim.ros.rmi.message_text import Definition
from iiwa_sim.ros.rmi.serialized import serialized

COMPRESSIONS = ("none", "cbor", "cbor-raw")
"""JSON; CBOR; CBOR around the bytes of ROS 1. If a client has several subscriptions to a topic, the last
of theirs in this order is used, as in rosbridge_suite."""

MOST_KINDS = 100
"""Number of encoded messages kept in the cache."""

_ARRAYS = {"float32": (85, "f"), "float64": (86, "d")}
"""Tags of typed arrays (RFC 8746), little-endian, which clients parse fast, and their elements."""

_json = msgspec.json.Encoder().encode


_newest: dict[tuple[str, str], tuple[dict[str, Any], str | bytes]] = {}


def encoded_once(
    compression: str, topic: str, kind: str, content: dict[str, Any], now: Callable[[], dict[str, int]]
) -> str | bytes:
    """The `publish` frame of a message, with ROS time from `now`: the newest message of a topic is encoded
    once for all clients."""
    known = _newest.get((compression, topic))
    if known is not None and known[0] is content:
        return known[1]
    frame = encoded(compression, topic, kind, content, now())
    if len(_newest) > MOST_KINDS:  # clients may spell a topic in many ways
        _newest.clear()
    _newest[compression, topic] = (content, frame)
    return frame


def encoded(
    compression: str, topic: str, kind: str, content: dict[str, Any], time: dict[str, int]
) -> str | bytes:
    """The `publish` frame of a message of type `kind`; `time` is ROS time."""
    if compression == "none":
        return _json({"op": "publish", "topic": topic, "msg": content}).decode()
    definition = message(kind)
    if compression == "cbor":
        told = _with_arrays(definition, content)
    else:
        told = {**time, "bytes": serialized(definition, content)}
    return dumps({"op": "publish", "topic": topic, "msg": told})


def _with_arrays(definition: Definition, content: dict[str, Any]) -> dict[str, Any]:
    """The content with lists of numbers as typed arrays."""
    told = dict(content)
    for field in definition.fields:
        value = content[field.name]
        if field.is_list and field.type in _ARRAYS:
            tag, element = _ARRAYS[field.type]
            told[field.name] = CBORTag(tag, struct.pack(f"<{len(value)}{element}", *value))
        elif "/" in field.type:
            part = message(field.type)
            told[field.name] = (
                [_with_arrays(part, each) for each in value] if field.is_list else _with_arrays(part, value)
            )
    return told
