"""Messages as CBOR. Needs the library cbor2, which comes with the extra rosbridge."""

import struct
from typing import Any

from cbor2 import CBORTag, dumps

FLOAT64_LITTLE_ENDIAN = 86
"""Tag of a typed array (RFC 8746), which clients parse fast."""


def encoded(message: Any) -> bytes:
    """Return a message as CBOR, its lists of floats as typed arrays."""
    return dumps(_with_arrays(message))


def _with_arrays(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _with_arrays(each) for name, each in value.items()}
    if not isinstance(value, list) or not value:
        return value
    if isinstance(value[0], float):
        return CBORTag(FLOAT64_LITTLE_ENDIAN, struct.pack(f"<{len(value)}d", *value))
    return [_with_arrays(each) for each in value]
