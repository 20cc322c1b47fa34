"""What the robot's process hands to the one that writes its recording, and how that becomes bytes.

A frame is a list of what happened, in the order of time, as MessagePack behind its length.
"""

from collections.abc import Sequence

import msgspec

from iiwa_sim.protocols.dialogue import DialogueLine
from iiwa_sim.robot.description import RobotDescription

_LENGTH_BYTES = 4


class Beginning(msgspec.Struct, frozen=True):
    """What is known before the first message: the first frame, by itself."""

    description: RobotDescription
    metadata: dict[str, str]
    attachments: dict[str, tuple[str, bytes]]
    """Attachments by their names: media type and content."""
    tick_rate_hz: int
    began_ns: int
    """Since 1970."""
    epoch_ns: int
    """The simulated time of tick 0, since 1970."""


class Said(msgspec.Struct, frozen=True, array_like=True, tag=1):
    """A line of the dialogue."""

    line: DialogueLine
    real_ns: int
    """Since 1970."""


class Ready(msgspec.Struct, frozen=True, array_like=True, tag=2):
    """A message as it is to be written."""

    topic: str
    data: bytes
    tick: int
    real_ns: int
    """Since 1970."""


class Lost(msgspec.Struct, frozen=True, array_like=True, tag=3):
    """Messages have found no room: so many by now."""

    messages: int


class Closed(msgspec.Struct, frozen=True, array_like=True, tag=4):
    """The recording was ended, and nothing follows."""


Handed = Said | Ready | Lost | Closed

_encode = msgspec.msgpack.Encoder(enc_hook=lambda number: number.item()).encode  # numpy's numbers
_decode = msgspec.msgpack.Decoder(list[Handed]).decode
_decode_beginning = msgspec.msgpack.Decoder(Beginning).decode


def frame_of(content: Beginning | Sequence[Handed]) -> bytes:
    """A frame, ready to be sent."""
    data = _encode(content)
    return len(data).to_bytes(_LENGTH_BYTES, "little") + data


def beginning_in(frame: bytes) -> Beginning:
    """What the first frame says; `frame` is without its length."""
    return _decode_beginning(frame)


def handed_in(frame: bytes) -> list[Handed]:
    """What any other frame says; `frame` is without its length."""
    return _decode(frame)


def messages_in(handed: Sequence[Handed]) -> int:
    """How many messages were handed over; what viewers are shown beside them does not count."""
    return sum(isinstance(each, Said | Ready) for each in handed)


class Frames:
    """Bytes, as they come, made frames again."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def taken(self, data: bytes) -> list[bytes]:
        """The frames that have become whole by these bytes, without their lengths."""
        self._bytes += data
        taken: list[bytes] = []
        position = 0
        while (begins := position + _LENGTH_BYTES) <= len(self._bytes):
            ends = begins + int.from_bytes(self._bytes[position:begins], "little")
            if ends > len(self._bytes):
                break
            taken.append(bytes(self._bytes[begins:ends]))
            position = ends
        del self._bytes[:position]
        return taken
