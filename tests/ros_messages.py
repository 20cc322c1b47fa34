"""Messages of ROS 1 drawn by hypothesis, and how the library rosbags reads their bytes."""

from __future__ import annotations

from typing import Any

from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from iiwa_sim.ros.rmi.definitions import message, parts
from iiwa_sim.ros.rmi.message_text import SINGLE, Definition, Field
from iiwa_sim.ros.rmi.node import PUBLISHED, SUBSCRIBED

MESSAGES = sorted({kind for kind, _ in PUBLISHED.values()} | set(SUBSCRIBED.values()))
VALUES: dict[str, st.SearchStrategy[Any]] = {
    "bool": st.booleans(),
    "string": st.text(max_size=10),
    "float32": st.floats(width=32, allow_nan=False, allow_infinity=False),
    "float64": st.floats(allow_nan=False),
    "int8": st.integers(-(2**7), 2**7 - 1),
    "int32": st.integers(-(2**31), 2**31 - 1),
    "uint32": st.integers(0, 2**32 - 1),
    "time": st.fixed_dictionaries({"secs": st.integers(0, 2**32 - 1), "nsecs": st.integers(0, 999_999_999)}),
}


def contents(definition: Definition) -> st.SearchStrategy[dict[str, Any]]:
    return st.fixed_dictionaries({field.name: _values(field) for field in definition.fields})


def _values(field: Field) -> st.SearchStrategy[Any]:
    one = VALUES[field.type] if field.type in VALUES else contents(message(field.type))
    return st.lists(one, max_size=3) if field.is_list else one


class Rosbags:
    """A reader of our messages."""

    def __init__(self) -> None:
        self._store = get_typestore(Stores.EMPTY)
        every = {part.name: part.text for name in MESSAGES for part in parts(message(name))}
        for name, text in every.items():
            self._store.register(get_types_from_msg(text, name.replace("/", "/msg/")))

    def reads(self, name: str, data: bytes) -> dict[str, Any]:
        """The message of that type, in plain words."""
        read = self._store.deserialize_ros1(data, name.replace("/", "/msg/"))
        return _plain(message(name), read)


def _plain(definition: Definition, read: Any) -> dict[str, Any]:
    def value(field: Field, told: Any) -> Any:
        if field.is_list:
            one = field._replace(length=SINGLE)
            return [value(one, each) for each in told]
        if field.type == "time":
            return {"secs": told.sec % 2**32, "nsecs": told.nanosec}  # rosbags takes seconds as signed
        return told if field.type in VALUES else _plain(message(field.type), told)

    return {field.name: value(field, getattr(read, field.name)) for field in definition.fields}
