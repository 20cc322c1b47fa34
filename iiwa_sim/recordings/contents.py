"""What is put into a recording, made the messages of its channels: in the thread that writes them."""

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import msgspec

from iiwa_sim.controller.reading import Reading
from iiwa_sim.dialect.wire.dialogue import DialogueLine
from iiwa_sim.recordings.state import StateLines
from iiwa_sim.recordings.views import Views
from iiwa_sim.recordings.writer import Message

SECOND_NS = 1_000_000_000
READING_BYTES = 1200
"""A line of state has about so many, and so has what waits to be one."""
_LINE_BYTES = 300  # of a line of the dialogue, beside its text


class Block(NamedTuple):
    """States of some ticks, one after the other."""

    readings: list[Reading]
    real_ns: list[int]
    """Of each of them, since 1970."""


class Told(NamedTuple):
    """Something to be recorded, as the robot's thread hands it over: with as little work as can be."""

    topic: str
    content: bytes | Block | DialogueLine
    """bytes are a message as it is."""
    tick: int
    """Of a block that of its first state."""
    real_ns: int
    """Since 1970."""

    @property
    def size(self) -> int:
        """Bytes that it takes until it is written, about."""
        content = self.content
        if isinstance(content, Block):
            return READING_BYTES * len(content.readings)
        if isinstance(content, bytes):
            return len(content)
        return len(content.text) + len(content.reason) + _LINE_BYTES


class Contents:
    """Makes them, of what is told in the order of time."""

    def __init__(self, lines: StateLines, views: Views, tick_rate_hz: int, began_ns: int) -> None:
        """`began_ns` is when the recording began, since 1970."""
        self.epoch_ns = began_ns
        """Of tick 0; to be set before the first message."""
        self._lines = lines
        self._views = views
        self._tick_rate_hz = tick_rate_hz
        self._began_ns = began_ns
        self._encode = msgspec.json.Encoder().encode

    def made(self, told: Iterable[Told]) -> Iterator[Message]:
        """The messages that these become, in their order."""
        line, log_ns, expand = self._lines.line, self.log_ns, self._views.expand
        for topic, content, tick, real_ns in told:
            if isinstance(content, Block):
                for reading, when_ns in zip(*content, strict=True):
                    message = Message(topic, line(reading), log_ns(reading.tick), when_ns)
                    yield message
                    yield from expand(message)
            elif isinstance(content, bytes):
                message = Message(topic, content, log_ns(tick), real_ns)
                yield message
                yield from expand(message)
            else:
                yield Message(topic, self._encode(self._said(content, real_ns)), log_ns(tick), real_ns)

    def log_ns(self, tick: int) -> int:
        """The time of a tick in the file."""
        return self.epoch_ns + tick * SECOND_NS // self._tick_rate_hz

    def when(self, tick: int, real_ns: int) -> dict[str, Any]:
        """How messages tell when something was."""
        return {
            "time_s": round(tick / self._tick_rate_hz, 9),
            "tick": tick,
            "real_s": round((real_ns - self._began_ns) / SECOND_NS, 6),
        }

    def _said(self, said: DialogueLine, real_ns: int) -> dict[str, Any]:
        return {
            **self.when(said.tick, real_ns),
            "session": said.session,
            "direction": said.direction.value,
            "text": said.text,
            "reason": said.reason,
            "dialect": said.dialect,
        }
